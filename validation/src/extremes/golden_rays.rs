//! T33: the golden rays find what exact fractions say.

use raywright_bvh::Accuracy;

use super::{
    ExtremesError, Findings, Settings,
    modes::{ACCURACIES, ask_all, label, name},
};
use crate::golden::read_cases;

/// T33.
pub(super) fn golden(settings: &Settings, findings: &mut Findings) -> Result<(), ExtremesError> {
    if !settings.golden.is_file() {
        findings.deviates(format!("there is no {}", settings.golden.display()));
        return Ok(());
    }
    let cases = read_cases(&settings.golden)?;
    let rays: usize = cases.iter().map(|case| case.rays.len()).sum();
    findings.demand(rays > 0, || "the file has no rays".to_owned());
    let embree = [
        "5, all at t = tnear",
        "0 but for 8 neighbours across an edge",
    ];
    for accuracy in ACCURACIES {
        let (mut wrong, mut recorded) = (0, 0);
        for case in &cases {
            let mesh = case.mesh().map_err(ExtremesError::Case)?;
            let answers = ask_all(&[&mesh], accuracy, |tree| {
                let fault = |index: usize| {
                    let fault = case.rays[index].fault(tree, mesh.vertices())?;
                    Some((
                        index,
                        format!("{} {index}, {}: {fault}", case.id, label(tree)),
                    ))
                };
                (0..case.rays.len()).filter_map(fault).collect::<Vec<_>>()
            })?;
            for index in 0..case.rays.len() {
                let mut faults = answers.iter().flatten().filter(|(ray, _)| *ray == index);
                if let Some((_, fault)) = faults.next() {
                    if accuracy == Accuracy::Fast && case.rays[index].is_hard() {
                        recorded += 1;
                    } else {
                        wrong += 1;
                        findings.faults.push(fault.clone());
                    }
                }
            }
        }
        findings.figure(
            format!("{}, wrong, or recorded at borders and ends", name(accuracy)),
            format!("{wrong}, {recorded} of {rays}"),
            embree[accuracy as usize],
        );
    }
    Ok(())
}
