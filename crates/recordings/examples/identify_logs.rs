//! Identifies one payload from several logs, and reports whether they agree:
//! `cargo run --example identify_logs -- arm.urdf tool0 bag1 bag2 bag3`.

use std::error::Error;
use std::io::Write;
use std::ops::ControlFlow;

use tactid_dynamics::Urdf;
use tactid_recordings::{Request, VALUE_NAMES, combine, identify_logs};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let (Some(urdf), Some(tip)) = (arguments.next(), arguments.next()) else {
        return Err("give a URDF, the name of the end-effector frame, and logs".into());
    };
    let logs: Vec<String> = arguments.collect();
    let request = Request {
        urdf: Some(Urdf::from_file(urdf.as_ref())?),
        tip: Some(tip),
        ..Request::default()
    };
    let runs = identify_logs(&logs, &request, &mut |_| ControlFlow::Continue(()))?;
    let whole = combine(&runs)?;
    let mut out = std::io::stdout().lock();
    let values = VALUE_NAMES
        .iter()
        .zip(whole.estimate.values())
        .zip(whole.estimate.std_devs);
    for ((name, value), std_dev) in values {
        writeln!(out, "{name:6} {value:10.5} ± {:.5}", 1.96 * std_dev)?;
    }
    let agreement = &whole.agreement;
    writeln!(
        out,
        "p = {:.2e}, agree: {}",
        agreement.p_value, agreement.agree
    )?;
    if let Some(largest) = agreement.largest.filter(|_| !agreement.agree) {
        let (log, sigmas) = (&logs[largest.run], largest.sigmas());
        writeln!(
            out,
            "{log} differs in {} by {sigmas:.1} standard deviations",
            largest.value
        )?;
    }
    Ok(())
}
