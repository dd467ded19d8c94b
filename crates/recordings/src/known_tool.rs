//! A known tool as a request gives it: numbers, or the result of an earlier identification.

use nalgebra::{Matrix3, SMatrix, Vector3};
use serde::{Deserialize, Deserializer};
use tactid_dynamics::MassProperties;
use tactid_identify::KnownTool;
use tactid_options::{Kind, Value};

/// Standard deviation of a centre of mass, and radius of gyration of an inertia, that an earlier
/// identification did not determine, m: larger than a tool, so that the payload's is not determined
/// either.
const REACH_M: f64 = 1.0;

/// A known body that the measured load contains besides the payload, as a request gives it.
#[derive(Clone, Debug, PartialEq)]
pub struct GivenTool {
    /// Mass properties in the tip's frame.
    pub body: MassProperties,
    /// Covariance of the linear parameters in the order of
    /// [`InertialParameters`](tactid_dynamics::InertialParameters); `None` where it is not given.
    pub covariance: Option<SMatrix<f64, 10, 10>>,
    /// Frame in which the body was identified; `None` where it is not known.
    pub frame: Option<String>,
}

impl From<MassProperties> for GivenTool {
    fn from(body: MassProperties) -> Self {
        Self {
            body,
            covariance: None,
            frame: None,
        }
    }
}

/// What is read of a tool. A centre of mass or an inertia that was not determined is missing.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Given {
    mass_kg: f64,
    center_of_mass: Option<[f64; 3]>,
    inertia: Option<[[f64; 3]; 3]>,
    covariance: Option<[[f64; 10]; 10]>,
    std_devs: Option<[Option<f64>; 10]>,
    frame: Option<String>,
}

impl Value for GivenTool {
    const KIND: Kind = Kind::Tool;

    fn read<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Given::deserialize(deserializer).map(Given::tool)
    }

    fn numbers(&self) -> Vec<f64> {
        let covariance = self.covariance.iter().flatten();
        self.body
            .numbers()
            .iter()
            .chain(covariance)
            .copied()
            .collect()
    }
}

impl Given {
    fn tool(self) -> GivenTool {
        let knows_com = self.center_of_mass.is_some();
        let knows_inertia = self.inertia.is_some() && knows_com;
        let inertia = self.inertia.filter(|_| knows_inertia).unwrap_or_default();
        let body = MassProperties {
            mass_kg: self.mass_kg,
            center_of_mass: Vector3::from(self.center_of_mass.unwrap_or_default()),
            inertia: Matrix3::from(inertia).transpose(),
        };
        let of_values = self.std_devs.map(|each| {
            let std_devs = each.map(|std_dev| std_dev.unwrap_or(0.0));
            KnownTool::with_std_devs(body, &std_devs).covariance
        });
        let given = self.covariance.map(SMatrix::from).or(of_values);
        GivenTool {
            body,
            covariance: given.map(|mut covariance| {
                let first_moment = (self.mass_kg * REACH_M).powi(2);
                let undetermined = [
                    (1..4, knows_com, first_moment),
                    (4..10, knows_inertia, first_moment * REACH_M.powi(2)),
                ];
                for (kind, is_known, variance) in undetermined {
                    for k in kind.filter(|_| !is_known) {
                        covariance.row_mut(k).fill(0.0);
                        covariance.column_mut(k).fill(0.0);
                        covariance[(k, k)] = variance;
                    }
                }
                covariance
            }),
            frame: self.frame,
        }
    }
}
