//! Text that is safe inside HTML and SVG, as content and as attribute value.

/// `text` with the five special characters replaced by entities.
///
/// Control characters other than tab and line feed are not allowed in XML in any spelling; they
/// become the replacement character.
pub(crate) fn escape(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\'' => escaped.push_str("&#39;"),
            '\t' | '\n' => escaped.push(character),
            control if control.is_control() => escaped.push('\u{fffd}'),
            plain => escaped.push(plain),
        }
    }
    escaped
}

/// `text` cut to at most `limit` characters, with an ellipsis where something is missing.
pub(crate) fn shorten(text: &str, limit: usize) -> String {
    if text.chars().count() <= limit {
        return text.to_string();
    }
    let kept: String = text.chars().take(limit.saturating_sub(1)).collect();
    format!("{kept}…")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn special_characters_become_entities() {
        assert_eq!(
            escape(r#"a<b>&"c'"#),
            "a&lt;b&gt;&amp;&quot;c&#39;".to_string()
        );
    }

    #[test]
    fn an_entity_is_escaped_again() {
        assert_eq!(escape("&lt;"), "&amp;lt;");
    }

    #[test]
    fn control_characters_do_not_survive() {
        assert_eq!(escape("a\u{0}b\u{1b}c\td\n"), "a\u{fffd}b\u{fffd}c\td\n");
    }

    #[test]
    fn letters_of_any_script_are_kept() {
        assert_eq!(escape("Würfel 立方体 ×"), "Würfel 立方体 ×");
    }

    #[test]
    fn shorten_counts_characters_not_bytes() {
        assert_eq!(shorten("äöü", 3), "äöü");
        assert_eq!(shorten("äöüß", 3), "äö…");
        assert_eq!(shorten("abc", 0), "…");
    }
}
