//! Where an Embree library may be.

use std::{
    env, fs,
    path::{Path, PathBuf},
};

/// The environment variable that names a library file, or a folder with one.
pub const VARIABLE: &str = "RAYWRIGHT_EMBREE";

/// The folder within the workspace that is searched last; `tools/fetch-embree` fills it.
pub const SEARCHED_FOLDER: &str = "target/embree";

#[cfg(target_os = "macos")]
const SYSTEM_NAMES: &[&str] = &["libembree4.dylib", "libembree4.4.dylib", "libembree3.dylib"];
#[cfg(windows)]
const SYSTEM_NAMES: &[&str] = &["embree4.dll", "embree3.dll"];
#[cfg(not(any(windows, target_os = "macos")))]
const SYSTEM_NAMES: &[&str] = &[
    "libembree4.so.4",
    "libembree4.so",
    "libembree3.so.3",
    "libembree3.so",
];

/// Files and names to try, in order. If the variable is set, nothing else is: whoever names a
/// library does not want another.
pub(super) fn candidates() -> Vec<PathBuf> {
    if let Some(named) = env::var_os(VARIABLE).filter(|named| !named.is_empty()) {
        let named = PathBuf::from(named);
        let inside = libraries_in(&named);
        return if inside.is_empty() {
            vec![named]
        } else {
            inside
        };
    }
    let mut candidates: Vec<PathBuf> = SYSTEM_NAMES.iter().map(PathBuf::from).collect();
    // Cargo names a member's folder to what it runs; else the current folder may be the workspace.
    let member = env::var_os("CARGO_MANIFEST_DIR").map(PathBuf::from);
    let above = member.iter().flat_map(|member| member.ancestors().take(2));
    let here = Path::new("");
    for workspace in above.chain([here]) {
        candidates.extend(libraries_in(&workspace.join(SEARCHED_FOLDER)));
    }
    candidates
}

/// The Embree libraries in a folder, newest name first; none if there is no such folder.
fn libraries_in(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = entries
        .map(|entry| entry.path())
        .filter(|path| {
            path.file_name()
                .is_some_and(|name| is_embree(&name.to_string_lossy()))
        })
        .collect();
    found.sort_by(|a, b| b.cmp(a));
    found
}

fn is_embree(name: &str) -> bool {
    let name = name.strip_prefix("lib").unwrap_or(name);
    let is_library = name.contains(".so") || name.ends_with(".dylib") || name.ends_with(".dll");
    is_library && name.starts_with("embree")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn libraries_are_known_by_their_names() {
        assert!(is_embree("libembree4-4aef3270.so.4"));
        assert!(is_embree("libembree4.4.dylib"));
        assert!(is_embree("embree4.dll"));
        assert!(!is_embree("libtbb-dcf63f8c.so.12"));
        assert!(!is_embree("embree.txt"));
        assert!(libraries_in(Path::new("no such folder")).is_empty());
    }
}
