"""Findings, faults and advice in words."""

import inspect
import math
import re
from dataclasses import replace
from typing import Any

import pytest

import doubles
from expectations import assert_fits_schema
from tactid import DataFault, Finding, Identifier, result_schema
from tactid._base.errors import ArgumentError
from tactid._base.naming import command_line_flag
from tactid._documents import result_json
from tactid._documents.finding_schemas import fault_kinds, finding_schema, kinds_of
from tactid._options.options import option_names
from tactid._show import remarks
from tactid._show.remarks import motion_advice

FINDING_KINDS = kinds_of(finding_schema())

FINDINGS = [
    Finding(
        "gravity_contradicted",
        {"better": [0.0, 0.0, 9.81], "residual_ratio": 1e-3, "method": "tactile"},
    ),
    Finding("too_few_windows", {"windows": 5, "least_windows": 10}),
    Finding("nothing_held", {"mass_kg": -0.0012, "std_dev_kg": 0.001}),
    Finding("negative_mass", {"method": "tactile", "or_gravity": True}),
    Finding("known_bodies_too_heavy", {"known_bodies_kg": 3.0, "load_kg": 2.0}),
    Finding(
        "wrong_assumption",
        {
            "cause": "offset",
            "runner_up": None,
            "names": ["force x", "force y", "force z", "moment x", "moment y", "moment z"],
            "values": [1.5, 0.0, 0.2, 0.0, 0.01, 0.0],
            "std_devs": [0.1, 0.1, 0.1, 0.01, 0.01, 0.01],
            "assumed": [0.0] * 6,
            "frame": "tool0",
            "along_m_s2": None,
            "residual_ratio": 0.1,
            "mass_kg": 2.0,
            "mass_std_dev_kg": 0.01,
            "mass_change": 0.02,
            "shift_m": 0.004,
            "value_change": 0.9,
            "is_applied": False,
        },
    ),
    Finding(
        "load_unexplained",
        {
            "unit": "N m",
            "residual_rms": 3.0,
            "load_rms": 10.0,
            "noise_rms": 0.07,
            "method": "effort",
            "has_unloaded": False,
            "joint": None,
        },
    ),
    Finding(
        "mass_contradicted",
        {
            "known_mass_kg": 2.0,
            "known_mass_std_dev_kg": 0.0,
            "found_kg": 1.8391,
            "std_dev_kg": 0.001,
            "distance": 160.9,
        },
    ),
    Finding(
        "runs_disagree",
        {
            "runs": 3,
            "run": "bag2",
            "others_agree": True,
            "recordings": ["bag1", "bag2", "bag3"],
            "chi_square": 812.4,
            "degrees_of_freedom": 19.4,
            "noise_degrees_of_freedom": 700.0,
            "p_value": 1e-30,
            "least_probable": "mass",
            "least_p_value": 1e-20,
            "value": "mass",
            "difference": 0.23,
            "of_others": 2.3,
            "sigmas": 25.3,
            "is_mass_uncertain": False,
        },
    ),
    Finding(
        "known_mass_not_kept",
        {
            "known_mass_kg": 2.0,
            "known_mass_std_dev_kg": 0.0,
            "estimated_kg": 4.0,
            "within_box": True,
        },
    ),
    Finding("inconsistent", {"distance": 7.0, "within_box": True}),
    Finding(
        "other_load",
        {"parts": [[8.0, 12.04]], "fraction": 0.203, "force_rms": 15.1, "moment_rms": 1.44},
    ),
    Finding("outliers", {"outliers": 3, "windows": 100}),
    Finding(
        "acceleration_not_used",
        {"topic": "/accel", "explains_better": True, "residual_ratio": 0.5, "power_ratio": 0.4},
    ),
    Finding(
        "option_not_used", {"option": "effort_noise", "because": "method", "method": "tactile"}
    ),
    Finding("frame_assumed", {"topic": "/wrench", "frame": "tool0"}),
    Finding("frame_followed", {"frame": "tcp", "link": "tool0", "origin_m": [0.0, 0.0, 0.05]}),
    Finding("axes_assumed", {"topic": "/wrench", "axes": "base_link", "point": "tool0"}),
    Finding(
        "topic_recognized",
        {
            "topic": "/xarm/uf_ftsensor_ext_states",
            "content": "xArm's wrench",
            "option": "wrench_topic",
            "value": "/xarm/uf_ftsensor_raw_states",
        },
    ),
    Finding("axes_contradicted", {"axes": "base", "residual_ratio": 0.05}),
    Finding("point_contradicted", {"frame": "base", "residual_ratio": 0.05}),
    Finding("effort_content_contradicted", {"content": "external", "residual_ratio": 0.08}),
    Finding("forces_summed", {"topics": ["/left", "/right"]}),
    Finding("joints_exchanged", {"joints": ["elbow", "pan"], "residual_ratio": 0.05}),
    Finding("joint_sign_contradicted", {"joint": "elbow", "residual_ratio": 0.05}),
    Finding(
        "orientation_contradicted",
        {"reading": "scalar_first", "of_base": False, "residual_ratio": 0.05},
    ),
    Finding("forces_and_moments_exchanged", {"residual_ratio": 0.05}),
    Finding("wrenches_summed", {"topics": ["/left", "/right"]}),
    Finding("joints_renamed", {"names": [("fer_1", "panda_1"), ("fer_2", "panda_2")]}),
    Finding("effort_noisier", {"joints": ["elbow"], "noise_ratios": [3.26]}),
    Finding(
        "friction_changed",
        {"change": 0.118, "joint": "elbow", "joint_change": 0.21, "has_unloaded": False},
    ),
    Finding(
        "gains_changed",
        {"change": 0.06, "joint": "elbow", "joint_change": -0.07, "has_unloaded": True},
    ),
    Finding("joint_uncalibrated", {"joint": "elbow"}),
    Finding(
        "calibration_contradicted",
        {"assumption": "gravity_tilted", "size": 0.0349, "std_dev": 0.0035, "joint": "elbow"},
    ),
    Finding("joint_zero_moved", {"size": -0.0213, "std_dev": 0.0025, "joint": "elbow"}),
    Finding("unloaded_left_out", {"noise_ratio": 5.4}),
    Finding(
        "unloaded_efforts_scaled",
        {"joints": ["shoulder", "elbow"], "ratios": [0.0941, 0.112], "has_gains": False},
    ),
    Finding("recording_calibrated", {"is_loaded": True}),
    Finding("unknown_joints", {"joints": ["finger"]}),
    Finding("absent_joints", {"joints": ["head"]}),
    Finding("late_start", {"topic": "/wrench", "late_s": 1.5}),
    Finding("early_end", {"topic": "/wrench", "end_s": 8.0, "early_s": 7.0}),
    Finding(
        "velocities_contradicted",
        {"joints": ["joint_1"], "relative_difference": 2.0, "cause": "degrees", "other": None},
    ),
    Finding(
        "positions_beyond_limits",
        {
            "joints": ["joint_1", "joint_2"],
            "position": -80.0,
            "lower": -3.14,
            "upper": 3.14,
            "are_degrees": True,
        },
    ),
    Finding(
        "efforts_beyond_limits",
        {
            "joints": ["joint_2", "joint_3"],
            "effort": 31234.0,
            "limit": 150.0,
            "limits_are_equal": True,
        },
    ),
    Finding("efforts_unmeasured", {"source": "/joint_states", "joints": ["elbow", "wrist"]}),
    Finding(
        "saturated",
        {
            "source": "/wrench",
            "channels": ["force z", "moment x"],
            "limits": [-20.0, 0.5],
            "fractions": [0.232, 0.05],
        },
    ),
    Finding(
        "twist_contradicted",
        {"source": "/odom", "relative_difference": 0.8, "better_axes": "world"},
    ),
    Finding(
        "constant_channels",
        {
            "source": "/wrench",
            "frame": "tool0",
            "channels": ["force x"],
            "is_zero": True,
            "is_left_out": False,
            "without_moments": False,
            "since_s": None,
            "is_most": False,
        },
    ),
    Finding(
        "poses_at_rest",
        {
            "attitudes": 12,
            "poses": 24,
            "samples": 2400,
            "frame": "sensor",
            "force_noise": 0.0096,
            "moment_noise": 0.0005,
            "next": {"gravity": [1.0, 0.0, -1.0], "value": "com x", "fraction": 0.98},
        },
    ),
    Finding(
        "outlying_pose",
        {
            "pose": 7,
            "first_row": 7,
            "last_row": 7,
            "channel": "force x",
            "residual": 2.31,
            "distance": 23.0,
            "is_left_out": True,
        },
    ),
    Finding("center_far_away", {"distance_m": 45.1, "half_width_m": 0.9, "frame": "sensor"}),
    Finding("heavy_load", {"mass_kg": 1201.0, "std_dev_kg": 1.0}),
    Finding("too_few_poses", {"poses": 3}),
    Finding("consists_of_rests", {"attitudes": 6, "rests": 6, "fraction": 0.83}),
    Finding("weight_or_offset", {"is_known": False}),
    Finding("angles_continued", {"joints": ["joint_1"], "count": 22}),
    Finding(
        "positions_jump",
        {
            "source": "/joint_states",
            "joints": ["joint_1", "joint_2"],
            "count": 400,
            "samples": 2200,
            "time_s": 0.003,
            "change": 2.05,
            "duration_s": 0.003,
        },
    ),
    Finding(
        "no_equations",
        {
            "samples": 750,
            "rejected": 0,
            "gaps": 0,
            "max_gap_s": 0.1,
            "period_s": 0.02,
            "window_s": 0.0926,
            "min_samples": 6,
        },
    ),
    Finding("stamps_missing", {"topics": ["/wrench"], "clock_rate": 0.6}),
    Finding("tool_uncertainty_assumed", {"std_dev": 0.01}),
    Finding("shape_contradicted", {"p_value": 1e-9, "scale": 0.001, "is_of_mass": False}),
    Finding("no_stamps"),
    Finding("topic_silent", {"topic": "/wrench", "silent_s": 3.04}),
    Finding("topics_not_used", {"topics": ["/left", "/right"]}),
    Finding("live_restarted", {"count": 2}),
    Finding("contact_throughout", {"fraction": 0.98}),
    Finding("delay_corrected", {"applied_s": 0.037, "estimated_s": 0.037, "std_dev_s": 1e-4}),
    Finding("delay_doubtful", {"delay_s": -0.488, "residual_ratio": 0.9, "is_at_end": False}),
    Finding("impossible_inertia", {"link": "arm", "moments": [-1e-8, 3.5e-8, 9.087e-8]}),
    Finding("impossible_mass", {"link": "foot", "mass_kg": 0.0}),
    Finding("unknown_numbers", {"link": "arm", "element": "inertia", "attributes": ["ixx", "ixy"]}),
    Finding("massless", {"links": [f"finger_{k}" for k in range(8)]}),
    Finding("joint_taken_as_fixed", {"joint": "drive", "joint_type": "planar"}),
    Finding("mimic_not_followed", {"joint": "a", "leader": "b", "because": "circular"}),
    Finding(
        "part_ignored",
        {"part": "unknown_element", "name": "contact", "inside": "link", "owners": ["a", "b"]},
    ),
]

SENTENCES = {
    "gravity_contradicted": (
        "Another gravity, (0, 0, 9.81) m/s², explains the wrench far better than the given one"
        " (with this, residuals are 0.10 % of those without): check `gravity` and the axes of the"
        " world."
    ),
    "too_few_windows": (
        "The residuals exceed the noise, and the recording is too short to show whether the model"
        " or the noise is wrong: it fills 5 windows, and 10 can show it. Do not use the values;"
        " record a longer motion."
    ),
    "nothing_held": (
        "Nothing is held, or too little for this recording: the mass is -0.0012 ± 0.0020 kg."
        " If something is, check the units of the load and the order of its channels."
    ),
    "negative_mass": (
        "The identified mass is negative: the opposite sign of the wrench"
        ' (`wrench_acts_on="sensor"`, or payload where sensor is given), or of gravity (`gravity`),'
        " would explain the data."
    ),
    "known_bodies_too_heavy": (
        "The known bodies weigh 3 kg, but the whole load only 2 kg: check the mass of"
        " `known_tool`, the links below the tip in the URDF, and the gains of the sensors."
    ),
    "wrong_assumption": (
        "The wrenches seem to have a constant offset: force (1.50 ± 0.20, 0.00 ± 0.20, 0.20 ±"
        " 0.20) N, moment (0.000 ± 0.020, 0.010 ± 0.020, 0.000 ± 0.020) N m, in the frame tool0"
        " and with the sign of the recorded wrenches (with this, residuals are 10 % of those"
        " without). Subtract it from the wrenches (tare the sensor), or let"
        ' `wrench_offset="yes"` identify it together with the payload.'
    ),
    "load_unexplained": (
        "The model does not explain 30 % of the load (rms 3.0 of 10.0 N m, 43 times the noise),"
        " and the intervals do not contain this error. Friction in the joints is the usual"
        " reason, then wrong inertias of the links or gains of the efforts: use `unloaded`, a"
        " recording of the same motion without the payload."
    ),
    "mass_contradicted": (
        "The given mass is 2 kg, but the data alone give 1.8391 ± 0.0020 kg, 160.9"
        " standard deviations away: check the given mass, which is in kg, gravity, and the gains"
        " and offsets of the sensors."
    ),
    "runs_disagree": (
        "The 3 recordings disagree by more than their noise (chi-square 812.4 for 19.4 degrees of"
        " freedom and noise from 700, p < 1e-06). bag2 differs most from the others, which agree:"
        " its mass by +10.0 % (+0.23 kg, 25.3 standard deviations). The intervals include what"
        " varies between the recordings, but not what is wrong in all of them."
    ),
    "known_mass_not_kept": (
        "The given mass is 2 kg, but the result has 4 kg: no physically consistent body of the"
        " given mass within the box explains the data."
    ),
    "inconsistent": (
        "No physically consistent body within the box explains the data within their noise. The"
        " result is the nearest one, 7.0 standard deviations away, and the intervals are widened"
        " until it is plausible: check the frames, the box, gravity, the offsets of the sensors,"
        " the known tool if one is given (`known_tool`), and whether a controller subtracts a"
        " payload from the wrenches (`wrench_is`)."
    ),
    "other_load": (
        "The wrenches from 8.0 s to 12.0 s, 20 % of the time, are not those of the load in the rest"
        " of the recording, by 15 N and 1.4 N m (rms): something touched the payload, or it was"
        " another one. They are left out, and the result is that of the rest."
    ),
    "outliers": (
        "3 of 100 windows are outliers, as an impact causes them, and have next to no weight."
    ),
    "acceleration_not_used": (
        "/accel is not used: accelerations derived from the velocities explain the wrench better"
        " (residuals 50 % as large, power 40 %). Give `acceleration_topic` to use it."
    ),
    "option_not_used": (
        "The option `effort_noise` has no effect: it is about measurements that the tactile"
        " method does not use with this recording."
    ),
    "frame_assumed": ("/wrench names no frame: its wrenches are taken to be in `tool0`."),
    "frame_followed": (
        "The frame `tcp` is in no description of the robot: /tf shows it fixed to `tool0`, at (0.0,"
        " 0.0, 50.0) mm."
    ),
    "axes_assumed": (
        "/wrench is in `base_link`, which does not move with the tool: its wrenches are taken to"
        " have the axes of `base_link`, and moments about the origin of `tool0`. `wrench_axes` and"
        " `sensor_frame` state other ones."
    ),
    "topic_recognized": (
        "By its name, /xarm/uf_ftsensor_ext_states is xArm's wrench: if so, give"
        " `/xarm/uf_ftsensor_raw_states` as `wrench_topic`."
    ),
    "axes_contradicted": (
        "The wrenches have the axes of `base`, not of the sensor: read so, their residuals are"
        " 5.0 % as large. To accept this, give `base` as `wrench_axes`."
    ),
    "point_contradicted": (
        "The moments of the wrenches are about the origin of `base`: read so, their residuals are"
        " 5.0 % as large. To accept this, give `base` with the origin 0, 0, 0 and the quaternion"
        " 0, 0, 0, 1 as `sensor_frame`."
    ),
    "effort_content_contradicted": (
        "The joint efforts contain only what the payload needs, nothing of the arm's own: read so,"
        " their residuals are 8.0 % as large. To accept this, give `external` as `efforts_are`."
    ),
    "forces_summed": (
        "The log has no wrenches: those of /left and /right are the sums of the forces at their"
        " points."
    ),
    "joints_exchanged": (
        "The values of the joints elbow and pan are exchanged: read so, residuals are 5.0 % as"
        " large. Messages often list joints by the alphabet; bring the columns into the order of"
        " the robot, or, of a log, give each value its joint by `rename_joints`."
    ),
    "joint_sign_contradicted": (
        "The values of the joint elbow have the opposite sign: read so, residuals are 5.0 % as"
        " large. Negate them, or turn the axis of this joint in the URDF."
    ),
    "orientation_contradicted": (
        "The orientations are read as `world_from_tool`, quaternions in the order x, y, z, w, but"
        " they seem to be quaternions in the order w, x, y, z: read so, residuals are 5.0 % as"
        " large; give w as the last of the four."
    ),
    "forces_and_moments_exchanged": (
        "Forces and moments are exchanged: read so, residuals are 5.0 % as large. Of a wrench, the"
        " three forces come first."
    ),
    "wrenches_summed": ("The wrenches of /left and /right are summed."),
    "joints_renamed": (
        "No joint in the log has the name of one in the URDF, so joints were matched behind their"
        " prefixes: fer_1 is panda_1 and fer_2 is panda_2; `rename_joints` names them."
    ),
    "effort_noisier": (
        "The effort of elbow is 3.3 times as noisy as at the calibration, and counts less; what the"
        " model does not explain may make the values wrong by more than their intervals. Check"
        " temperature, wear and what else has changed, and calibrate anew."
    ),
    "friction_changed": (
        "Friction differs from the calibration by about 12 % (most at elbow, +21 %). Temperature"
        " and wear do that. Record an unloaded motion of the same day, or calibrate anew."
    ),
    "gains_changed": (
        "The gains of the efforts differ from the calibration by about 6 % (most at elbow, -7 %)."
        " Temperature changes gains by a few percent; the zero of a joint that has moved, and the"
        " calibration of another robot, look the same. The unloaded recording has updated the"
        " calibration."
    ),
    "joint_uncalibrated": (
        "elbow moves, but did not move when the arm was calibrated: its friction is not known, and"
        " its effort counts little. Record a motion of this joint in both directions, and calibrate"
        " anew."
    ),
    "calibration_contradicted": (
        "The calibration is contradicted by its own recordings. The efforts fit far better with"
        " gravity tilted by 2 ± 0.39 degrees, which the efforts of elbow show most. The error is in"
        " the calibration, and its intervals do not contain it. Check `gravity`, and how the arm is"
        " mounted, and calibrate anew."
    ),
    "joint_zero_moved": (
        "The data fit better if the zero of elbow has moved since the calibration: with positions"
        " of 0.021 ± 0.0049 rad less, 8.5 standard deviations from none. The intervals do not"
        " contain such an error. Check the order of the joints and the zero of this one: set it as"
        " it was, or calibrate anew."
    ),
    "unloaded_left_out": (
        "The unloaded recording was left out: with it the efforts would fit 5.4 times worse."
        " Friction differs between the two recordings, or they are of different robots. Record the"
        " unloaded motion at the same temperature, or identify without `unloaded`."
    ),
    "unloaded_efforts_scaled": (
        "The efforts of the unloaded arm are 0.094 (shoulder) and 0.11 (elbow) times what its"
        " weight needs by the URDF: they may be motor currents, or have another unit, and the load"
        " is wrong by the same factor. Give `effort_gain` for every joint, about 11 (shoulder) and"
        " 8.9 (elbow), or calibrate the arm. If they are in N m, the masses of the URDF are wrong"
        " and the result is right: a gain of 1 for every joint says so."
    ),
    "recording_calibrated": (
        "This recording calibrated the arm with the payload that was given for it: the result"
        " repeats what was given, and is no check of it. Identify another recording."
    ),
    "unknown_joints": (
        "Joints that the URDF does not have, or that do not move in it, were left out: finger."
    ),
    "absent_joints": (
        "Joints that the log does not have, and that do not move the tool, were taken to be at"
        " zero: head."
    ),
    "late_start": ("/wrench begins 1.500 s after the others: what came before was left out."),
    "early_end": (
        "/wrench ends at 8.000 s, 7.000 s before the others: what came after was left out."
    ),
    "velocities_contradicted": (
        "The velocities of joint_1 are not the derivatives of the positions (rms difference 200 %"
        " of the motion). They are in degrees per second, but must be in rad/s."
    ),
    "positions_beyond_limits": (
        "The positions of joint_1 and joint_2 are beyond the limits of the URDF: joint_1 reaches"
        " -80, and its limits are -3.14 and 3.14. They are in degrees, but must be in rad (and the"
        " velocities in rad/s)."
    ),
    "efforts_beyond_limits": (
        "The efforts of joint_2 and joint_3 are far beyond the limits of the URDF: that of joint_2"
        " is 3.123e+04 on average, and its limit is 150. They must be torques in N m, or forces in"
        " N: check their unit and the gains (`effort_gain`). The limits of the URDF are all the"
        " same, and may be placeholders."
    ),
    "efforts_unmeasured": (
        "/joint_states: the efforts of elbow and wrist (`effort`) are exactly zero in all samples"
        " of a motion, as of a driver that does not measure them. The estimate takes them for"
        " measured: record the efforts of all joints that move the tip, or identify from wrenches"
        " (`method`)."
    ),
    "saturated": (
        "/wrench is saturated: force z at -20 N in 23 % and moment x at 0.5 N m in 5.0 % of the"
        " samples, and never beyond, while others change. What exceeds the range of a sensor or a"
        " drive is not measured, and the values may be wrong by more than their intervals: move"
        " more slowly, with less load, or with a larger range."
    ),
    "twist_contradicted": (
        "/odom: the twist is not the derivative of the pose (rms difference 80 % of the motion)."
        " It is in the axes of the world, but the twist of an odometry message must be in those"
        " of its child frame."
    ),
    "constant_channels": (
        "/wrench: force x in `tool0` is exactly zero in all samples, as of a sensor that does not"
        " measure it. The estimate takes it for measured."
    ),
    "poses_at_rest": (
        "The payload is identified from 12 attitudes at rest in 24 poses (the means of 2400"
        " samples); poses at rest never show the inertia. The intervals follow from the noise"
        " between poses, 0.0096 N and 0.0005 N m. A further attitude with gravity in the middle"
        " between +x and -z of sensor would help most: the interval of com x becomes 2 % narrower."
    ),
    "outlying_pose": (
        "Row 7 does not fit the other poses: force x is 2.31 N away, 23 standard deviations, as"
        " after a contact or a bump of the sensor. It was left out; measure it again."
    ),
    "center_far_away": (
        "The centre of mass is 45.1 m away from the origin of the frame sensor, farther than that"
        " of anything that an arm holds: the moments are too large for the forces, as in N mm. Give"
        " forces in N and moments in N m; of a table, `columns` states other units."
    ),
    "heavy_load": (
        "The load weighs 1201.0 ± 2.0 kg, more than most arms lift: the forces may be in another"
        " unit, as in mN. Give forces in N and moments in N m; of a table, `columns` states other"
        " units."
    ),
    "too_few_poses": (
        "3 poses are too few to tell a load of zero from a wrong assumption, such as gravity in"
        " another direction (a base on a wall) or orientations in another form: measure in four"
        " attitudes or more, or state `gravity`."
    ),
    "consists_of_rests": (
        "The recording consists of 6 rests in 6 attitudes, 83 % of its time. Rests show the mass"
        " and the centre of mass; the inertia shows in the moves between them alone, if it does."
        " The intervals follow from the noise within the rests, and do not contain what differs"
        " between attitudes, such as a hysteresis: the means of the rests as poses at rest show it."
    ),
    "weight_or_offset": (
        "The recording keeps the tool in one attitude to gravity, in which the weight of the"
        " payload and a zero of the sensor that was never set are one: the mass is that of both, or"
        " unknown where the zero is identified, too. Record at least three attitudes;"
        ' `wrench_offset="no"` accepts a sensor that reads zero without the payload.'
    ),
    "angles_continued": (
        "The positions of joint_1 start again after a turn, 22 times: they were continued."
    ),
    "positions_jump": (
        "The positions of joint_1 and joint_2 jump 400 times in 2200 samples, faster than any joint"
        " moves (that of joint_1 by 2.05 within 3 ms at 0.003 s): two publishers write to"
        " /joint_states. Record that of the robot's driver alone, and stop the other one, such as a"
        " joint_state_publisher."
    ),
    "no_equations": (
        "Nothing is known of the payload: there is a sample every 20 ms, which is too slow for the"
        " cutoff. A window of 0.0926 s needs at least 6 samples: push samples at a higher rate, or"
        " lower `cutoff_hz`."
    ),
    "stamps_missing": (
        "/wrench has no stamps: their times are those of logging, brought to the clock of the"
        " stamps of other topics, which runs at 0.6 times the rate of the recorder's."
    ),
    "tool_uncertainty_assumed": (
        "The known tool has no uncertainty of its own: a standard deviation of 1.0 % of its values"
        " is assumed and is part of the intervals. `known_tool_std_dev` gives another one, and an"
        " earlier result as `known_tool` has its own."
    ),
    "shape_contradicted": (
        "The measurements contradict the shape (`shape`, p < 1e-06): with 0.001 m as the unit of"
        " its file (`shape_scale`) they agree. The result does not use it."
    ),
    "no_stamps": ("The messages have no stamps: their times are those of logging."),
    "topic_silent": (
        "/wrench has had no message for 3.0 s: its publisher has ended, or its messages do not"
        " arrive."
    ),
    "topics_not_used": (
        "/left and /right came after the identification began and are not used; `wrench_topic` and"
        " `joint_topic` name the topics to use."
    ),
    "live_restarted": (
        "The identification has started again 2 times, because messages no longer gave samples: a"
        " clock has jumped, or the joints have other names."
    ),
    "contact_throughout": (
        "The wrench of the contact is beyond four standard deviations in 98 % of the samples:"
        " unless something touched the payload nearly all the time, it is another one than the"
        " given payload, or the zero or the sign of the sensor is another."
    ),
    "delay_corrected": (
        "The wrenches are stamped 37.00 ms later than the motion: this delay was corrected"
        " (estimated 37.00 ± 0.20 ms)."
    ),
    "delay_doubtful": (
        "A delay of the wrenches, stamped 488 ms earlier than the motion, would fit better, but"
        " only a little (its residuals are 90 % as large): it was not corrected. Check whether"
        " all sensors of the payload were recorded, and the frames and signs; `delay_s` sets a"
        " delay."
    ),
    "impossible_inertia": (
        "Link `arm`: no rigid body has its inertia, with the principal moments -1e-08, 3.5e-08,"
        " 9.09e-08 kg m²: none may be negative, or exceed the sum of the other two. It was used as"
        " the URDF has it."
    ),
    "impossible_mass": (
        "Link `foot`: it has an inertia, but a mass of zero. It was used as the URDF has it."
    ),
    "unknown_numbers": (
        "Link `arm`: ixx and ixy of <inertia> in its <inertial> are no finite numbers, or missing:"
        " each was taken to be zero."
    ),
    "massless": (
        "Links `finger_0`, `finger_1`, `finger_2`, `finger_3`, `finger_4` and 3 more move but have"
        " no mass, and were taken to be massless: right for virtual links, as in a ball joint of"
        " three hinges; else give them an <inertial> in the URDF."
    ),
    "joint_taken_as_fixed": (
        "Joint `drive` is of type planar, which has several degrees of freedom: it was taken to be"
        " fixed at zero."
    ),
    "mimic_not_followed": (
        "Joint `a` mimics `b`, which mimics it in turn: it was taken to move by itself."
    ),
    "part_ignored": (
        "The element <contact> in <link>, which URDF does not have, was ignored: in `a` and `b`."
    ),
}
"""What each of them says to a caller of ``tactid.identify``."""

ONLINE = {
    "inconsistent": (
        "No physically consistent body within the box explains the data within their noise. The"
        " result is the nearest one, 7.0 standard deviations away: check the frames, the box,"
        " gravity, the offsets of the sensors, the known tool if one is given (`known_tool`), and"
        " whether a controller subtracts a payload from the wrenches (`wrench_is`)."
    ),
    "positions_jump": (
        "The positions of joint_1 and joint_2 jump 400 times in 2200 samples, faster than any joint"
        " moves (that of joint_1 by 2.05 within 3 ms at 0.003 s): two sources are mixed in them:"
        " push those of one robot alone."
    ),
    "efforts_beyond_limits": (
        "The efforts of joint_2 and joint_3 are far beyond the limits of the URDF: that of joint_2"
        " is 3.123e+04 on average, and its limit is 150. They must be torques in N m, or forces in"
        " N: check their unit and the gains. The limits of the URDF are all the same, and may be"
        " placeholders."
    ),
    "negative_mass": (
        "The identified mass is negative: the opposite sign of the wrench (`wrench_acts_on`"
        " (sensor), or payload where sensor is given), or of gravity (`gravity`), would explain the"
        " data."
    ),
    "known_bodies_too_heavy": (
        "The known bodies weigh 3 kg, but the whole load only 2 kg: check the links below the tip"
        " in the URDF, and the gains of the sensors."
    ),
    "wrong_assumption": (
        "The wrenches seem to have a constant offset: force (1.50 ± 0.20, 0.00 ± 0.20, 0.20 ±"
        " 0.20) N, moment (0.000 ± 0.020, 0.010 ± 0.020, 0.000 ± 0.020) N m, in the frame tool0"
        " and with the sign of the pushed wrenches (with this, residuals are 10 % of those"
        " without). Subtract it from the wrenches before `push` (tare the sensor), or let"
        " `wrench_offset` (yes) identify it together with the payload."
    ),
    "load_unexplained": (
        "The model does not explain 30 % of the load (rms 3.0 of 10.0 N m, 43 times the noise),"
        " and the intervals do not contain this error. Friction in the joints is the usual"
        " reason, then wrong inertias of the links or gains of the efforts: subtract the efforts"
        " of the same motion without the payload before `push`."
    ),
    "efforts_unmeasured": (
        "/joint_states: the efforts of elbow and wrist (`effort`) are exactly zero in all samples"
        " of a motion, as of a driver that does not measure them. The estimate takes them for"
        " measured: record the efforts of all joints that move the tip."
    ),
}
"""The sentences for a caller of ``push``, where they differ."""

ONLINE_KINDS = (
    "gravity_contradicted",
    "nothing_held",
    "negative_mass",
    "known_bodies_too_heavy",
    "wrong_assumption",
    "load_unexplained",
    "inconsistent",
    "outliers",
    "velocities_contradicted",
    "positions_beyond_limits",
    "efforts_beyond_limits",
    "efforts_unmeasured",
    "saturated",
    "twist_contradicted",
    "constant_channels",
    "angles_continued",
    "positions_jump",
    "no_equations",
)
"""The findings of ``Identifier``, besides those of the URDF."""


BACKTICKED = re.compile(r"`(\w+)`")
CHOICE = re.compile(r'`(\w+)="(\w+)"`')


def test_every_finding_is_pinned_to_its_sentences() -> None:
    assert [each.kind for each in FINDINGS] == list(SENTENCES)
    assert set(SENTENCES) == set(FINDING_KINDS)
    for each in FINDINGS:
        assert str(each) == each.worded("keyword") == SENTENCES[each.kind]


@pytest.mark.parametrize("kind", FINDING_KINDS)
def test_a_finding_names_options_as_a_user_of_the_command_writes_them(kind: str) -> None:
    (found,) = (each for each in FINDINGS if each.kind == kind)

    def flag(name: re.Match[str]) -> str:
        return command_line_flag(name[1]) if name[1] in option_names("log") else name[0]

    def choice(name: re.Match[str]) -> str:
        return f"`{command_line_flag(name[1])} {name[2]}`"

    sentence = CHOICE.sub(choice, BACKTICKED.sub(flag, SENTENCES[kind]))
    assert found.worded("command-line") == sentence


CONTRADICTIONS = (
    "positions_jump",
    "positions_beyond_limits",
    "velocities_contradicted",
    "twist_contradicted",
    "efforts_unmeasured",
    "saturated",
    "center_far_away",
    "weight_or_offset",
    "gravity_contradicted",
    "calibration_contradicted",
    "joint_zero_moved",
    "unloaded_efforts_scaled",
    "axes_contradicted",
    "point_contradicted",
    "effort_content_contradicted",
    "orientation_contradicted",
    "forces_and_moments_exchanged",
    "joints_exchanged",
    "joint_sign_contradicted",
    "shape_contradicted",
    "too_few_windows",
    "negative_mass",
    "known_bodies_too_heavy",
    "mass_contradicted",
)
"""The findings here that show a result to be wrong, wrong measurements before what they cause."""

DOUBTS = (
    "efforts_beyond_limits",
    "heavy_load",
    "contact_throughout",
    "too_few_poses",
    "recording_calibrated",
    "wrong_assumption",
    "topic_silent",
    "topics_not_used",
    "live_restarted",
    "nothing_held",
    "outlying_pose",
    "other_load",
    "known_mass_not_kept",
    "constant_channels",
    "load_unexplained",
    "inconsistent",
)
"""The findings here for which no precision is promised."""


def test_the_gravest_findings_come_first() -> None:
    by_severity = {
        severity: [each.kind for each in FINDINGS if each.severity == severity]
        for severity in ("contradicts", "doubts")
    }
    assert set(by_severity["contradicts"]) == set(CONTRADICTIONS)
    assert set(by_severity["doubts"]) == set(DOUBTS)
    ranks = {each.kind: each.rank for each in FINDINGS}
    order = [ranks[kind] for kind in (*CONTRADICTIONS, *DOUBTS)]
    assert order == sorted(order)


def test_a_finding_that_nobody_can_have_noticed_is_refused() -> None:
    with pytest.raises(ArgumentError, match="no finding of the kind negative_mas "):
        str(Finding("negative_mas", {}))
    with pytest.raises(ArgumentError, match="no finding of the kind outliers with these data"):
        str(Finding("outliers", {"outliers": 1}))


def test_online_a_finding_names_no_option_that_the_identifier_does_not_have() -> None:
    """What has no option is done to the samples."""
    known = {*option_names("online"), *inspect.signature(Identifier.push).parameters, "push"}
    known.add("tool0")  # a frame
    for each in FINDINGS:
        if each.kind in ONLINE_KINDS:
            for method in ("tactile", "effort", "joint-sensing", "combined"):
                found = replace(each, data={**each.data, "method": method}, style="online")
                assert set(BACKTICKED.findall(str(found))) <= known, str(found)
            online = ONLINE.get(each.kind, SENTENCES[each.kind])
            assert each.worded("online") == online


def test_an_unloaded_recording_is_not_recommended_where_it_was_used() -> None:
    (found,) = (each for each in FINDINGS if each.kind == "load_unexplained")
    for style in ("keyword", "command-line"):
        used = Finding(found.kind, {**found.data, "has_unloaded": True}, style)
        assert str(used) == (
            "The model does not explain 30 % of the load (rms 3.0 of 10.0 N m, 43 times the noise),"
            " and the intervals do not contain this error. The unloaded recording does not remove"
            " it: check that both recordings have the same speed and temperature, and the gains of"
            " the efforts."
        )


FAULTS = {
    "gap": "3 gaps were not bridged",
    "clock_back": "the clock of the stamps went back 3 times",
    "out_of_order": "3 samples out of order were left out",
    "put_in_order": "3 samples out of order were put in order",
    "undecodable": "3 messages that cannot be decoded were left out",
    "not_finite": "3 samples with a value that is not finite were left out",
    "point_not_finite": "3 points without finite numbers were left out of the sum, which lacks"
    " their force",
    "out_of_range": "3 samples with a value out of range (beyond 1e9) were left out",
    "partial_joints": "3 messages with only some of the publisher's joints were left out",
    "position_count": "3 messages with another number of positions than of names were left out",
    "velocity_not_finite": "3 velocities that are not finite were derived from the positions",
    "no_velocity": "3 messages have no velocities, which were derived from the positions",
    "no_effort": "3 messages without efforts were left out",
    "effort_not_finite": "3 samples with an effort of elbow that is not finite were left out",
    "not_unit_quaternion": (
        "3 samples with an orientation that is no unit quaternion were left out"
    ),
    "no_stamp": "3 messages have no stamp: the time of logging is used",
    "far_stamp": "3 messages with a stamp far from the time of logging were left out",
    "incomplete": "3 samples at which another stream has no value were left out",
}


def test_a_fault_says_what_how_often_and_when_first() -> None:
    assert set(FAULTS) == set(fault_kinds())
    for kind, sentence in FAULTS.items():
        assert str(DataFault("/topic", kind, 3, joint="elbow")) == f"/topic: {sentence}."
    one = DataFault("/topic", "no_velocity", 1, 3.5)
    assert str(one) == (
        "/topic: 1 message has no velocities, which were derived from the positions, at 3.500 s."
    )
    many = DataFault("samples", "incomplete", 2, 3.5)
    assert str(many) == (
        "2 samples at which another stream has no value were left out, the first at 3.500 s."
    )


def test_numbers_agree_with_their_nouns_and_a_gap_is_reported_once() -> None:
    one = doubles.with_estimate(doubles.tactile(duration=4.0), rejected=1, gaps=1)
    assert remarks.remarks(one) == [
        "1 sample was rejected: not finite, or out of order.",
        "1 gap in the recording was not bridged.",
    ]
    where = replace(one, faults=[DataFault("/wrench", "gap", 1, 2.0)])
    assert remarks.remarks(where)[1:] == ["/wrench: 1 gap was not bridged, at 2.000 s."]
    outlier = Finding("outliers", {"outliers": 1, "windows": 100})
    assert str(outlier) == (
        "1 of 100 windows is an outlier, as an impact causes it, and has next to no weight."
    )


def test_advice_names_the_least_motion_that_determines_all() -> None:
    assert motion_advice([]) == []
    assert motion_advice(["Iyy"]) == ["Rotate the tool faster about its y axis, for Iyy."]
    assert motion_advice(["Ixx", "Ixy", "Iyz"]) == [
        "Rotate the tool faster about its x and y or z axes, for Ixx, Ixy and Iyz."
    ]
    mass, com = motion_advice(["mass", "com z"])
    assert "under gravity" in mass
    assert "its x or y axis" in com


@pytest.mark.parametrize(
    ("kind", "changed", "words"),
    [
        ("gravity_contradicted", {"residual_ratio": 0.135}, "residuals are 14 % of those"),
        ("gravity_contradicted", {"residual_ratio": 1e-9}, "residuals are under 0.001 % of"),
        ("acceleration_not_used", {"power_ratio": 2.5}, "residuals 50 % as large, power 250 %"),
        ("delay_corrected", {}, "stamped 37.00 ms later than the motion: this delay was corrected"),
        ("load_unexplained", {}, "30 % of the load (rms 3.0 of 10.0 N m, 43 times the noise)"),
        ("load_unexplained", {"joint": "elbow"}, "30 % of the effort of elbow (rms 3.0 of 10.0"),
        ("load_unexplained", {"load_rms": 0.0}, "explain the load, which is zero (rms 3.0 of 0.0"),
        ("wrong_assumption", {}, "force (1.50 ± 0.20, 0.00 ± 0.20, 0.20 ± 0.20) N, moment (0.000"),
        (
            "wrong_assumption",
            {"cause": "axes", "values": [-1.0] * 6},
            "All channels of the wrench have the opposite sign (with this, residuals are 10 % of"
            ' those without). State it by `wrench_acts_on="sensor"`, or payload where sensor is'
            " given.",
        ),
        (
            "wrong_assumption",
            {"cause": "weight", "values": [1.2, 0.0, 0.0, 0.05], "along_m_s2": [0.0, 0.0, -9.81]},
            "along the assumed gravity, (0, 0, -9.81) m/s², although gravity is another one; the",
        ),
        (
            "wrong_assumption",
            {
                "cause": "weight",
                "values": [0.405, 0.0, 0.01, 0.05],
                "std_devs": [0.003] * 4,
                "assumed": [0.202, 0.0, 0.0, 0.05],
            },
            "is not that of the configured payload, 0.202 kg at (0, 0, 0.05) m, but one of 0.4050 ±"
            " 0.0059 kg at (0.0000 ± 0.0059, 0.0100 ± 0.0059, 0.0500 ± 0.0059) m: the static load",
        ),
        (
            "wrong_assumption",
            {
                "cause": "weight",
                "values": [0.001, 0.0, 0.0, 0.0],
                "std_devs": [0.003] * 4,
                "assumed": [0.202, 0.0, 0.0, 0.05],
            },
            "but none: the static load corresponds to 2 kg, the dynamic load to 2.000 ± 0.020 kg"
            " (with this, residuals are 10 % of those without). The wrenches are raw: leave out"
            " `configured_payload` and `wrench_is`.",
        ),
        (
            "wrong_assumption",
            {
                "cause": "gravity",
                "runner_up": "weight",
                "values": [0.0, 0.0, -9.8],
                "std_devs": [0.0, 0.0, 0.05],
                "assumed": [0.0, 0.0, -1.0],
            },
            "Gravity of 9.800 ± 0.098 m/s² explains the wrenches far better than the given one"
            " (with this, residuals are 10 % of those without), with a mass of 2.000 ± 0.020 kg.",
        ),
        (
            "wrong_assumption",
            {
                "cause": "gravity",
                "values": [0.0, 0.0, -9.8],
                "std_devs": [0.0, 0.0, 0.05],
                "assumed": [0.0, 0.0, 9.81],
            },
            "Gravity of the opposite sign, (0, 0, -9.800 ± 0.098) m/s² in world axes, explains the",
        ),
        (
            "wrong_assumption",
            {
                "cause": "saturation",
                "names": ["force z", "moment x"],
                "values": [-20.04, 1.5],
                "std_devs": [0.0, 0.0],
                "assumed": [math.inf, math.inf],
            },
            "The sensor is saturated: force z at about -20 N and moment x at about 1.5 N m (with"
            " this, residuals are 10 % of those without). Move more slowly, with less load, or with"
            " a sensor of a larger range.",
        ),
        (
            "shape_contradicted",
            {"scale": None, "is_of_mass": True},
            "without the known mass (`known_mass_kg`) they agree, so that the mass is wrong. The",
        ),
        (
            "delay_corrected",
            {"applied_s": -0.012, "estimated_s": -0.0121},
            "stamped 12.00 ms earlier than the motion: this delay was corrected (estimated 12.10 ±",
        ),
        (
            "wrong_assumption",
            {"cause": "delay", "values": [-0.012], "std_devs": [0.001]},
            "The wrenches are earlier than the motion by 0.0120 ± 0.0020 s",
        ),
        (
            "wrong_assumption",
            {"cause": "weight", "values": [-1.188, 0.0, 0.0, 0.1], "std_devs": [0.01] * 4},
            "seems to be added to the wrenches, of 1.188 ± 0.020 kg at (0.000 ± 0.020,",
        ),
        ("delay_doubtful", {"delay_s": 0.5}, "stamped 500 ms later than the motion, would fit"),
        (
            "delay_doubtful",
            {"is_at_end": True},
            "better, but it is as long as any that is searched",
        ),
        ("poses_at_rest", {"is_contradicted": True}, "between poses, 0.0096 N and 0.0005 N m."),
        ("impossible_inertia", {}, "principal moments -1e-08, 3.5e-08, 9.09e-08 kg m²"),
        ("impossible_mass", {}, "it has an inertia, but a mass of zero."),
        ("impossible_mass", {"mass_kg": -2.0}, "its mass of -2 kg is negative."),
        ("unknown_numbers", {}, "ixx and ixy of <inertia> in its <inertial> are no finite numbers"),
        ("massless", {}, "Links `finger_0`, `finger_1`, `finger_2`, `finger_3`, `finger_4` and 3"),
        ("massless", {"links": ["a"]}, "Link `a` moves but has no mass, and was taken to be"),
        ("mimic_not_followed", {}, "Joint `a` mimics `b`, which mimics it in turn: it was taken"),
        ("mimic_not_followed", {"leader": ""}, "Joint `a` mimics no joint by name"),
        ("part_ignored", {}, "<contact> in <link>, which URDF does not have, was ignored: in `a`"),
        ("part_ignored", {"part": "repeated_element"}, "Every <contact> in <link> but the first"),
        ("part_ignored", {"part": "unknown_attribute"}, "The attribute `contact` of <link>, which"),
    ],
)
def test_a_finding_is_in_words(kind: str, changed: dict[str, Any], words: str) -> None:
    (found,) = (each for each in FINDINGS if each.kind == kind)
    assert words in str(Finding(kind, {**found.data, **changed}))


def test_the_schema_describes_the_data_of_every_finding() -> None:
    found = replace(doubles.tactile(duration=4.0), findings=FINDINGS)
    record = result_json.record(found)
    assert_fits_schema(record)
    for shown in record["findings"]:
        for key in shown:
            if key not in ("kind", "text"):
                other = {name: value for name, value in shown.items() if name != key}
                with pytest.raises(AssertionError, match="is not valid under"):
                    assert_fits_schema({**record, "findings": [other]})
        with pytest.raises(AssertionError, match="is not valid under"):
            assert_fits_schema({**record, "findings": [{**shown, "other_key": 1}]})


UNIT = re.compile(
    r"\b(kg|m|s|Hz|rad|N|ns|percent)\b|m/s²|without a unit|in the unit|Number of", re.IGNORECASE
)


def numbers_without_a_unit(path: str, part: Any, described: str = "") -> list[str]:
    """The numbers of a schema of which neither the key nor a description states the unit."""
    if not isinstance(part, dict):
        return []
    described = part.get("description", described)
    if {"number", "integer"} & {
        *([part["type"]] if isinstance(part.get("type"), str) else part.get("type", []))
    }:
        return [] if UNIT.search(described) or path.endswith(SUFFIXES) else [path]
    found = []
    for key, child in part.items():
        children = child if key == "properties" else {key: child}
        if key in ("anyOf", "oneOf"):
            children = {str(index): each for index, each in enumerate(child)}
        if isinstance(children, dict):
            for name, below in children.items():
                found += numbers_without_a_unit(f"{path}/{name}", below, described)
    return found


SUFFIXES = ("_s", "_ns", "_hz", "_m", "_rad", "_deg", "_kg", "_n", "_m_s2")


def test_every_number_of_the_schema_has_a_unit_in_its_key_or_description() -> None:
    for schema in (result_schema(), result_schema("nlms")):
        # The units of the ten values stand where they are referred to.
        definitions = {**schema["$defs"]}
        del definitions["TenValues_double"]
        whole = {"properties": schema["properties"], "$defs": {"properties": definitions}}
        assert numbers_without_a_unit("", whole) == []
    assert numbers_without_a_unit("", {"properties": {"bare": {"type": "number"}}}) == ["/bare"]


def test_remarks_of_a_sound_result_are_none() -> None:
    assert remarks.remarks(doubles.tactile()) == []


def test_a_change_beyond_temperature_and_wear_names_the_wrong_robot() -> None:
    data = {"change": 1.1, "joint": "elbow", "joint_change": -2.7, "has_unloaded": True}
    for kind in ("friction_changed", "gains_changed"):
        text = str(Finding(kind, data))
        assert "check that the calibration is of this" in text
        assert "Temperature and wear do that" not in text
        assert Finding(kind, data).contradicts_result


def test_a_wrench_that_stops_and_velocities_of_zero_have_words_of_their_own() -> None:
    (constant,) = (each for each in FINDINGS if each.kind == "constant_channels")
    for is_most in (False, True):
        data = {**constant.data, "since_s": 10.0, "is_most": is_most}
        stopped = Finding(constant.kind, data)
        assert "the wrench in `tool0` is exactly constant from 10.000 s on" in str(stopped)
        assert "(`end_s`)" in str(stopped)
        assert stopped.contradicts_result == is_most
    (velocities,) = (each for each in FINDINGS if each.kind == "velocities_contradicted")
    zero = Finding(velocities.kind, {**velocities.data, "cause": "not_measured"})
    assert str(zero) == (
        "The velocities of joint_1 are exactly zero at the beginning of the recording, although"
        " these joints move: they are not measured, and those of all joints were derived from the"
        " positions."
    )
    assert zero.severity == "notes"


def test_a_difference_larger_than_the_value_has_no_percentage() -> None:
    (disagreement,) = (each for each in FINDINGS if each.kind == "runs_disagree")
    two = {"run": None, "recordings": ["box", "weight"], "difference": 3.5, "of_others": 0.9}
    text = str(Finding("runs_disagree", {**disagreement.data, **two}))
    assert "weight differs from box most in mass, by +3.5 kg (25.3 standard deviations)." in text


def test_a_joint_that_a_calibration_does_not_explain_may_be_exchanged() -> None:
    (found,) = (each for each in FINDINGS if each.kind == "load_unexplained")
    for has_unloaded in (False, True):
        data = {**found.data, "joint": "elbow", "has_unloaded": has_unloaded}
        text = str(Finding(found.kind, data))
        assert "two joints with large errors are often exchanged" in text
        assert "unloaded" not in text


def test_a_given_mass_in_grams_is_named_and_contradicts_the_result() -> None:
    (found,) = (each for each in FINDINGS if each.kind == "mass_contradicted")
    grams = {**found.data, "known_mass_kg": 2500.0, "found_kg": 2.496, "distance": 1e6}
    finding = Finding(found.kind, grams)
    assert "which is in kg (as grams it would be 2.5 kg), gravity" in str(finding)
    assert finding.contradicts_result
    assert not Finding(found.kind, {**found.data, "distance": 20.0}).contradicts_result


def test_a_change_beyond_the_model_has_no_number() -> None:
    data = {"change": 7.7, "joint": "elbow", "joint_change": -19.0, "has_unloaded": False}
    text = str(Finding("friction_changed", data))
    assert "by more than 100 % (most at elbow)." in text


def test_a_negative_gain_has_another_cause() -> None:
    data = {"size": -1.3, "std_dev": 0.21, "joint": "elbow"}
    text = str(Finding("gain_contradicted", data))
    assert "an unloaded recording that holds a payload, exchanged joints" in text
    assert "--loaded" not in text
    assert "%" not in text


def test_friction_as_large_as_the_load_is_named_before_the_order_of_joints() -> None:
    (found,) = (each for each in FINDINGS if each.kind == "load_unexplained")
    text = str(Finding(found.kind, {**found.data, "residual_rms": 15.0, "load_rms": 15.0}))
    assert text.index("Calibrate the arm") < text.index("check the order of the joints")


def test_consequences_of_wrong_measurements_are_not_listed() -> None:
    kinds = ("positions_beyond_limits", "load_unexplained", "friction_changed", "effort_noisier")
    noticed = [each for each in FINDINGS if each.kind in kinds]
    (sentence,) = remarks.remarks(replace(doubles.tactile(), findings=noticed))
    assert sentence.startswith("The positions of joint_1 and joint_2 are beyond the limits")


def test_gains_of_another_robot_contradict_the_result() -> None:
    data = {"change": 1.9, "joint": "elbow", "joint_change": 4.0, "has_unloaded": True}
    finding = Finding("gains_changed", data)
    assert finding.contradicts_result
    assert "Check that it is of this robot, and identify without it." in str(finding)
    # One joint of another robot of the type, whose mean change is that of a warm arm.
    assert Finding(
        "gains_changed", {**data, "change": 0.09, "joint_change": -0.19}
    ).contradicts_result
    small = Finding("gains_changed", {**data, "change": 0.1, "joint_change": 0.12})
    assert not small.contradicts_result
    assert "identify without it" not in str(small)


def test_given_gains_of_an_unloaded_arm_are_doubted_and_contradict_nothing() -> None:
    data = {"joints": ["shoulder", "elbow"], "ratios": [0.1, 0.1], "has_gains": True}
    finding = Finding("unloaded_efforts_scaled", data)
    assert finding.severity == "doubts"
    assert "The gains of the efforts (`effort_gain`) may be wrong: with them" in str(finding)


def test_a_negative_mass_by_efforts_claims_no_sign_and_no_option_that_is_refused() -> None:
    text = str(Finding("negative_mass", {"method": "effort", "or_gravity": True}))
    assert "the opposite sign of the effort (`effort_gain` with a minus sign)" in text
    assert "a body at or below the tip that the URDF has and the robot does not" in text
    assert "motor currents whose gains are not given" in text
    assert "would explain" not in text
    # With a calibration.
    text = str(Finding("negative_mass", {"method": "effort", "or_gravity": False}))
    assert "currents" not in text
    assert "effort_gain" not in text
    assert "another order of the joints" in text
