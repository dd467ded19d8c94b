//! A calibration whose file has something in each of its parts.

use nalgebra::{Isometry3, SVector, Vector3};
use tactid_batch::Delay;
use tactid_calibrate::{
    Assumption, CalibratingRecording, Calibration, CalibrationReport, Contradiction, EffortNoise,
    JointCalibration, LinkCalibration, LinkDescription, MotionShortage,
};
use tactid_dynamics::InertialParameters;
use tactid_recordings::ArmCalibration;

/// Numbers without a pattern, whose digits fill a float.
struct Numbers(u64);

impl Numbers {
    fn one(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        let mantissa = (self.0 >> 11) as f64 / (1_u64 << 53) as f64 + 0.5;
        let exponent = ((self.0 >> 3) % 40) as i32 - 20;
        mantissa * 10_f64.powi(exponent)
    }

    fn some(&mut self, count: usize) -> Vec<f64> {
        (0..count).map(|_| self.one()).collect()
    }

    /// Returns the lower triangle of a matrix with a large diagonal.
    fn triangle(&mut self, rows: usize) -> Vec<f64> {
        let entries = (0..rows).flat_map(|row| (0..=row).map(move |column| (row, column)));
        let entry = |(row, column)| {
            let small = 1e-22 * self.one();
            if row == column {
                1.0 + 3.0 / (row as f64 + 7.0)
            } else {
                -small
            }
        };
        entries.map(entry).collect()
    }

    fn ten(&mut self) -> [f64; 10] {
        std::array::from_fn(|_| self.one())
    }

    fn body(&mut self) -> InertialParameters {
        InertialParameters::from_vector(SVector::from(self.ten()))
    }
}

pub(crate) const UNKNOWNS: usize = 2 * 10 + 2 * (6 + 3) + 1;
pub(crate) const NAMES: [&str; 2] = ["turn \"1\"", "slide"];
pub(crate) const LINKS: [&str; 2] = ["upper", "lower"];

/// One contradiction of each kind.
fn contradictions(numbers: &mut Numbers) -> Vec<Contradiction> {
    let assumptions = [
        Assumption::Gravity,
        Assumption::JointZero,
        Assumption::Gains,
        Assumption::PayloadCenter { payload: 3 },
        Assumption::GainPrior {
            prior_std_dev: numbers.one(),
        },
        Assumption::Links,
    ];
    let contradiction = |assumption: Assumption| Contradiction {
        assumption,
        size: -numbers.one(),
        std_dev: numbers.one(),
        joint: NAMES[0].to_owned(),
        shown: matches!(
            assumption,
            Assumption::Gravity | Assumption::PayloadCenter { .. }
        )
        .then(|| [(); 3].map(|()| numbers.one())),
    };
    assumptions.map(contradiction).to_vec()
}

/// Recordings with fingerprints that no signed number and no float contains.
fn recordings() -> Vec<CalibratingRecording> {
    let each = [(0, false), (u64::MAX, true), (0xfedc_ba98_7654_3211, true)];
    each.map(|(fingerprint, is_loaded)| CalibratingRecording {
        fingerprint,
        is_loaded,
    })
    .to_vec()
}

/// A calibration of two joints and links with three friction terms, of which each number is
/// another.
pub(crate) fn arm() -> ArmCalibration {
    let mut numbers = Numbers(7);
    let mut parameters = numbers.some(UNKNOWNS);
    for parameter in parameters.iter_mut().take(36).step_by(3) {
        *parameter = -*parameter;
    }
    let delay_s = -1.0 / 71.0;
    parameters[UNKNOWNS - 1] = delay_s;
    let noise = || EffortNoise {
        white: 0.1,
        slow: 1.0 / 3.0,
        slow_time_s: 0.7,
        standstill: 2e-17,
    };
    let joints = (0..2).map(|index| joint(&mut numbers, &parameters, index, noise()));
    let joints = joints.collect();
    let links = (0..2).map(|index| link(&mut numbers, &parameters, index));
    let links = links.collect();
    let model = Calibration {
        tool: "tool0".to_owned(),
        joints: NAMES.map(str::to_owned).to_vec(),
        links: LINKS.map(str::to_owned).to_vec(),
        descriptions: [0, 1]
            .map(|index| description(&mut numbers, index))
            .to_vec(),
        gravity: Vector3::new(numbers.one(), 0.0, -9.81),
        cutoff_hz: 7.0 / 3.0,
        friction_widths: vec![0.005, 0.05, 0.5],
        scales: numbers.some(UNKNOWNS),
        precision: numbers.triangle(UNKNOWNS),
        noise: vec![noise(), noise()],
        reference_torques: vec![31.0 / 7.0, 1.0 / 17.0],
        log_evidence: numbers.one(),
        parameters,
    };
    let report = CalibrationReport {
        windows: 123,
        window_s: model.window_s(),
        delay: Delay {
            delay_s,
            std_dev_s: numbers.one(),
        },
        joints,
        links,
        payloads: vec![numbers.body()],
        shortages: shortages(&mut numbers),
        contradictions: contradictions(&mut numbers),
        recordings: recordings(),
    };
    ArmCalibration {
        model,
        report,
        effort_gain: numbers.some(2),
    }
}

fn joint(
    numbers: &mut Numbers,
    parameters: &[f64],
    index: usize,
    noise: EffortNoise,
) -> JointCalibration {
    JointCalibration {
        name: NAMES[index].to_owned(),
        unit: ["N m", "N"][index],
        gain: 1.0 / parameters[36 + index],
        gain_std_dev: numbers.one(),
        offset: parameters[20 + index],
        viscous: parameters[22 + index],
        friction: (0..3).map(|k| parameters[24 + 2 * k + index]).collect(),
        load_friction: parameters[30 + index],
        payload_friction: parameters[32 + index],
        rotor_inertia: parameters[34 + index],
        noise,
        max_velocity: [numbers.one(), numbers.one()],
        residual_before: numbers.one(),
        residual_after: numbers.one(),
        residual_held_out: numbers.one(),
    }
}

fn link(numbers: &mut Numbers, parameters: &[f64], index: usize) -> LinkCalibration {
    let calibrated = &parameters[10 * index..10 * index + 10];
    LinkCalibration {
        name: LINKS[index].to_owned(),
        described: numbers.body(),
        calibrated: InertialParameters::from_vector(SVector::from_column_slice(calibrated)),
        std_devs: numbers.ten(),
    }
}

fn description(numbers: &mut Numbers, index: usize) -> LinkDescription {
    LinkDescription {
        parent_from_link: Isometry3::new(
            Vector3::from_fn(|_, _| numbers.one()),
            Vector3::new(0.3, -0.2, 1.1 + index as f64),
        ),
        axis: Vector3::new(1.0, 2.0, 3.0 + index as f64).normalize(),
        parameters: numbers.body(),
    }
}

fn shortages(numbers: &mut Numbers) -> Vec<MotionShortage> {
    vec![
        MotionShortage::Still {
            joint: NAMES[1].to_owned(),
            max_velocity: numbers.one(),
        },
        MotionShortage::OneDirection {
            joint: NAMES[1].to_owned(),
            is_positive: false,
        },
        MotionShortage::Gain {
            joint: NAMES[0].to_owned(),
            std_dev: numbers.one(),
        },
    ]
}
