//! Arguments that identification takes from arrays and online alike: the robot, its joints, and the
//! wrenches.

use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::arrays::Series;
use crate::dynamics::Manipulator;
use crate::errors::ArgumentError;
use crate::text::Text;

type Argument<'a, 'py> = Option<&'a Bound<'py, PyAny>>;

/// Reads the robot.
pub(crate) fn read_robot<'py>(given: &Bound<'py, PyAny>) -> PyResult<Bound<'py, Manipulator>> {
    if let Ok(robot) = given.cast::<Manipulator>() {
        return Ok(robot.clone());
    }
    let kind = given.get_type().name()?;
    Err(ArgumentError::new_err(format!(
        "`robot` is of type {kind}: expected a tactid.Manipulator, which tactid.Manipulator.from_urdf reads from a URDF"
    )))
}

/// Reads the links of the sensors: one name, or several.
pub(crate) fn read_sensors(given: &Bound<'_, PyAny>) -> PyResult<Vec<String>> {
    if given.is_instance_of::<PyString>() {
        return Ok(vec![given.extract::<Text>()?.0]);
    }
    given.extract().map_err(|_| {
        ArgumentError::new_err(format!(
            "`sensors` is {given}: expected the name of a link, or a list of names"
        ))
    })
}

/// Returns names as the crates take them.
pub(crate) fn borrowed(names: &[String]) -> Vec<&str> {
    names.iter().map(String::as_str).collect()
}

/// Reads the joints' positions, velocities and efforts; `dof` is `None` where there is no robot,
/// and so no joint.
pub(crate) fn read_joints(
    given: [Argument<'_, '_>; 3],
    dof: Option<usize>,
) -> PyResult<[Series; 3]> {
    let [q, qd, effort] = given;
    let read = |name: &'static str, given: Argument<'_, '_>| match (dof, given) {
        (Some(dof), given) => Series::read_or_empty(given, name, dof),
        (None, None) => Series::read_or_empty(None, name, 0),
        (None, Some(_)) => Err(ArgumentError::new_err(format!(
            "`{name}` is given without a robot: give `robot`, whose joints these are"
        ))),
    };
    Ok([read("q", q)?, read("qd", qd)?, read("effort", effort)?])
}

/// Reads the wrenches of a number of sensors: those of one sample or of N, and for one sensor with
/// or without its own axis.
pub(crate) fn read_wrenches(given: Argument<'_, '_>, sensors: usize) -> PyResult<Series> {
    let Some(given) = given else {
        return Series::read_or_empty(None, "wrench", 0);
    };
    match sensors {
        0 => Err(ArgumentError::new_err(
            "`wrench` is given, but there is no sensor: name its link in `sensors`",
        )),
        1 => Series::read_one_of(
            given,
            "wrench",
            &[&[6], &[1, 6]],
            "force and moment of one sensor; name the links of several in `sensors`",
        ),
        _ => {
            let items: [&[usize]; 1] = [&[sensors, 6]];
            let what = format!("force and moment of each of the {sensors} `sensors`");
            Series::read_one_of(given, "wrench", &items, &what)
        }
    }
}
