//! Where a NIfTI file places its grid: the sform (a matrix) and the qform (a quaternion).
//!
//! `nifti1.h`, "3D image (volume) orientation and location in space": either is there if its code
//! is positive. The sform is used first (method 3), then the qform (method 2); with neither only
//! the distances between voxels are known (method 1). Both are kept, and told if they disagree.

use glam::{DMat3, DQuat, DVec3};

use super::{
    super::{Placement, PlacementSource, Warning, layout::direction},
    header::Fields,
};
use crate::grid::Orientation;

/// Sine of an angle, and share of a length, from which two descriptions are not the same.
const TOLERANCE: f64 = 1e-3;

/// The descriptions that can be used, in the order of preference.
pub(super) fn of(
    fields: &Fields<'_>,
    spacing: [f64; 3],
    warnings: &mut Vec<Warning>,
) -> Vec<Placement> {
    let places = fields.places;
    let mut placements = Vec::new();
    let forms = [
        (PlacementSource::Sform, fields.code(places.sform_code)),
        (PlacementSource::Qform, fields.code(places.qform_code)),
    ];
    for (source, code) in forms {
        if code <= 0 {
            continue;
        }
        let found = match source {
            PlacementSource::Sform => sform(fields, spacing, warnings),
            _ => qform(fields),
        };
        match found {
            Some(orientation) => placements.push(Placement {
                source,
                space: space(code).into(),
                orientation,
            }),
            None => warnings.push(Warning::PlacementUnusable { source }),
        }
    }
    if let [used, other] = &placements[..]
        && disagree(&used.orientation, &other.orientation, spacing)
    {
        warnings.push(Warning::PlacementsDisagree {
            used: used.source,
            other: other.source,
        });
    }
    placements
}

/// The space that a code means.
fn space(code: i32) -> &'static str {
    match code {
        1 => "scanner",
        2 => "aligned",
        3 => "talairach",
        4 => "mni 152",
        _ => "other",
    }
}

fn sform(
    fields: &Fields<'_>,
    spacing: [f64; 3],
    warnings: &mut Vec<Warning>,
) -> Option<Orientation> {
    let entry = |row: usize, column: usize| fields.real(fields.places.srow, row * 4 + column);
    let column = |column: usize| DVec3::from_array([0, 1, 2].map(|row| entry(row, column)));
    let columns = [column(0), column(1), column(2)];
    let orientation = orientation(columns, column(3))?;
    let lengths = columns.map(DVec3::length);
    let differs =
        |(length, spacing): (&f64, f64)| (length - spacing.abs()).abs() > TOLERANCE * spacing.abs();
    if lengths.iter().zip(spacing).any(differs) {
        warnings.push(Warning::PlacementSpacing {
            source: PlacementSource::Sform,
            given: lengths.map(|length| length as f32),
        });
    }
    Some(orientation)
}

fn qform(fields: &Fields<'_>) -> Option<Orientation> {
    let [b, c, d, x, y, z] = [0, 1, 2, 3, 4, 5].map(|i| fields.real(fields.places.quatern, i));
    let vector = DVec3::new(b, c, d);
    if !vector.as_vec3().is_finite() {
        return None;
    }
    // Rounding makes the length a little more than 1 for half turns: the real part is 0 then.
    let real = (1.0 - vector.length_squared()).max(0.0).sqrt();
    let turn = DQuat::from_xyzw(b, c, d, real).normalize();
    let mut axes = DMat3::from_quat(turn);
    if fields.pixdim(0) < 0.0 {
        axes.z_axis = -axes.z_axis;
    }
    orientation([axes.x_axis, axes.y_axis, axes.z_axis], DVec3::new(x, y, z))
}

/// Unit vectors along the columns, if they span space.
fn orientation(columns: [DVec3; 3], origin: DVec3) -> Option<Orientation> {
    let mut axes = [DVec3::ZERO; 3];
    for (axis, column) in axes.iter_mut().zip(columns) {
        *axis = direction(column)?;
    }
    let [x, y, z] = axes;
    let flat = x.cross(y).dot(z).abs() < 1e-9;
    let origin = origin.as_vec3();
    (!flat && origin.is_finite()).then_some(Orientation {
        axes: axes.map(|axis| axis.as_vec3()),
        origin,
    })
}

fn disagree(a: &Orientation, b: &Orientation, spacing: [f64; 3]) -> bool {
    let turned = |axis: usize| a.axes[axis].distance(b.axes[axis]) > TOLERANCE as f32;
    let unit = spacing.map(f64::abs).into_iter().fold(f64::MAX, f64::min);
    let moved = f64::from(a.origin.distance(b.origin));
    (0..3).any(turned) || moved > (TOLERANCE * f64::from(a.origin.length())).max(0.01 * unit)
}
