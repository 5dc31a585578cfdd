//! A property test over all classes of meshes.

use std::fmt;

use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestError, TestRng, TestRunner};
use raywright_bvh::{Accuracy, TriangleMesh};

use super::{Accelerator, Case, Checker, Fault, MeshClass, cases};

/// How an accelerator is tried. A trial is a function of its settings.
#[derive(Clone, Copy, Debug)]
pub struct Trial {
    accuracy: Accuracy,
    cases: u32,
    seed: u8,
}

impl Trial {
    /// 256 meshes of each class; `accuracy` as in [`Checker::new`].
    #[must_use]
    pub fn new(accuracy: Accuracy) -> Self {
        Self {
            accuracy,
            cases: 256,
            seed: 0,
        }
    }

    /// So many meshes of each class.
    #[must_use]
    pub fn with_cases(self, cases: u32) -> Self {
        Self { cases, ..self }
    }

    /// Other meshes and rays.
    #[must_use]
    pub fn with_seed(self, seed: u8) -> Self {
        Self { seed, ..self }
    }

    /// Checks the accelerator that `build` makes of each mesh beside exact hits. The mesh is geometry 0.
    ///
    /// # Errors
    /// The first fault, with a mesh as small as could be found.
    ///
    /// # Panics
    /// If `build` or the accelerator does, or if the accelerator's answers to a ray about a mesh are not always the same.
    pub fn run<A: Accelerator>(
        &self,
        build: impl Fn(&TriangleMesh) -> A,
    ) -> Result<(), Box<Counterexample>> {
        MeshClass::ALL
            .into_iter()
            .try_for_each(|class| self.run_class(class, &build))
    }

    /// The same for one class.
    ///
    /// # Errors
    /// As [`run`](Self::run).
    ///
    /// # Panics
    /// As [`run`](Self::run).
    pub fn run_class<A: Accelerator>(
        &self,
        class: MeshClass,
        build: impl Fn(&TriangleMesh) -> A,
    ) -> Result<(), Box<Counterexample>> {
        let config = Config {
            cases: self.cases,
            failure_persistence: None,
            max_shrink_iters: 4096,
            ..Config::default()
        };
        let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &[self.seed; 32]);
        let mut runner = TestRunner::new_with_rng(config, rng);
        let first_fault = |case: &Case| {
            let meshes = [&case.mesh];
            let checker = Checker::new(&meshes, self.accuracy);
            let accelerator = build(&case.mesh);
            let mut checked = case
                .rays
                .iter()
                .map(|ray| checker.beside_exact(&accelerator, ray));
            checked.find_map(Result::err)
        };
        let outcome = runner.run(&cases(class), |case| match first_fault(&case) {
            None => Ok(()),
            Some(fault) => Err(TestCaseError::fail(fault.to_string())),
        });
        let Err(TestError::Fail(_, case)) = outcome else {
            // No case is ever rejected.
            return Ok(());
        };
        let fault = first_fault(&case).expect("the same answers as before");
        let mut counterexample = Counterexample {
            class,
            mesh: case.mesh,
            fault,
        };
        counterexample.leave_out_triangles(self.accuracy, build);
        Err(Box::new(counterexample))
    }
}

/// A mesh about which an accelerator is wrong.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct Counterexample {
    /// The class of the mesh.
    pub class: MeshClass,
    /// The mesh, geometry 0.
    pub mesh: TriangleMesh,
    /// The ray, and what is wrong.
    pub fault: Fault,
}

impl Counterexample {
    /// Leaves out, one by one, triangles without which the ray has the same finding. The class is then that of the mesh
    /// from which they were taken: a copy of a triangle may be alone.
    fn leave_out_triangles<A: Accelerator>(
        &mut self,
        accuracy: Accuracy,
        build: impl Fn(&TriangleMesh) -> A,
    ) {
        for triangle in (0..self.mesh.triangles().len()).rev() {
            let mut triangles = self.mesh.triangles().to_vec();
            triangles.remove(triangle);
            let Ok(mesh) = TriangleMesh::new(self.mesh.vertices().to_vec(), triangles) else {
                continue;
            };
            if mesh.triangles().is_empty() {
                continue;
            }
            let meshes = [&mesh];
            let checker = Checker::new(&meshes, accuracy);
            let checked = checker.beside_exact(&build(&mesh), &self.fault.ray);
            if let Err(fault) = checked
                && fault.finding == self.fault.finding
            {
                (self.mesh, self.fault) = (mesh, fault);
            }
        }
    }
}

impl fmt::Display for Counterexample {
    /// All that is needed to ask again.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { class, mesh, fault } = self;
        writeln!(f, "{fault}")?;
        writeln!(f, "mesh ({class:?}), vertices:")?;
        for vertex in mesh.vertices() {
            writeln!(f, "  {:?}", vertex.to_array())?;
        }
        write!(f, "triangles: {:?}", mesh.triangles())
    }
}

impl std::error::Error for Counterexample {}
