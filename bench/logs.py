"""From logs whose noise the simulator draws: 1 % of each channel's peak on every channel, 20 seeds.

Run by `make bench-study-logs`. All six joints move at once; a first run without noise gives the
peaks, of each joint, of each axis of the base, of its IMU and of each finger. A seed draws anew the
noise of the sensors and of the command. The controllers do not feel it: it is in the logs alone.
The rows with a lag are what is known online at the time.
"""

import tempfile
from pathlib import Path

import numpy as np
from recorded import FINGERS, Array, Recorded, scales
from rich.console import Console
from rich.progress import track
from rich.table import Table

import tactid
from tactid._base.values import values_of

SEEDS = 20
LEVEL = 0.01
SECONDS = [1, 10]
METHODS = {
    "tactile": {"method": "tactile"},
    "effort": {"method": "effort"},
    "joint sensing": {"method": "joint-sensing"},
    "combined": {"method": "combined"},
    "combined, IMU": {"method": "combined", "imu_topic": "/base/imu"},
}
ONLINE = {
    "tactile, online": ("tactile", tactid.Identifier),
    "tactile, lag 0.1 s": ("tactile", tactid.LagIdentifier),
    "combined, online": ("combined", tactid.Identifier),
    "combined, lag 0.1 s": ("combined", tactid.LagIdentifier),
}


def main() -> None:
    """Prints the worst of ten, and each, for each method and time."""
    text = Path(__file__).with_name("all_joints.toml").read_text()
    experiment = tactid.Experiment.from_toml(text)
    robot = tactid.Manipulator.from_urdf(experiment.urdf, "floating")
    found = {(method, seconds): [] for method in [*METHODS, *ONLINE] for seconds in SECONDS}
    with tempfile.TemporaryDirectory() as folder:
        log = Path(folder) / "run.mcap"
        tactid.simulate(experiment, log)
        noisy = tactid.Experiment.from_toml(text + noise(log))
        for seed in track(range(SEEDS), "seeds", console=Console(stderr=True)):
            for seconds in SECONDS:
                # The first second of the longer run is this very one.
                tactid.simulate(noisy.replace(seed=seed, duration=seconds), log)
                for method, options in METHODS.items():
                    estimate = tactid.identify(log, **options).estimate
                    found[method, seconds].append(estimate.values)
                recorded = Recorded.read(log)
                for name, (method, kind) in ONLINE.items():
                    found[name, seconds].append(
                        online(recorded, kind(robot, FINGERS, method=method))
                    )
    title = f"{100 * LEVEL:g} % noise in the logs, {SEEDS} seeds: rms error in %"
    table = Table("method", "after", "worst", *tactid.VALUE_NAMES, title=title)
    for (method, seconds), values in found.items():
        errors = 100 * (np.array(values) - values_of(experiment.payload))
        rms = np.sqrt(np.mean((errors / scales(experiment.payload)) ** 2, axis=0))
        table.add_row(method, f"{seconds} s", *(f"{value:.2g}" for value in (rms.max(), *rms)))
    Console(width=120).print(table)


def online(recorded: Recorded, identifier: tactid.Identifier | tactid.LagIdentifier) -> Array:
    """The ten values after the last sample, of windows where there is no estimate with a lag."""
    identifier.push(
        recorded.time,
        recorded.q,
        recorded.qd,
        recorded.wrench,
        effort=recorded.effort,
        pose=recorded.pose(),
        twist=recorded.world_twist(),
    )
    return (identifier.estimate() or identifier.window_estimate()).values


def noise(log: Path) -> str:
    """The experiment's section that gives each channel a fraction of its peak in this log.

    Forces at contact points have none: nothing is identified from them.
    """
    recorded, imu = Recorded.read(log), tactid.read(log, "/base/imu")
    twist, count = recorded.world_twist(), len(recorded.time)
    channels = {
        "joint_position_rad": recorded.q,
        "joint_velocity_rad_s": recorded.qd,
        "joint_torque_nm": recorded.effort,
        "base_position_m": recorded.position,
        # Small rotations: twice the quaternion's vector part.
        "base_orientation_rad": 2 * recorded.orientation[:, :3],
        "base_velocity_m_s": twist[:, :3],
        "base_angular_velocity_rad_s": twist[:, 3:],
        "imu_angular_velocity_rad_s": imu["angular_velocity"],
        "imu_acceleration_m_s2": imu["linear_acceleration"],
        "finger_force_n": recorded.wrench[:, :, :3].reshape(count, 6),
        "finger_moment_nm": recorded.wrench[:, :, 3:].reshape(count, 6),
    }
    lines = [f"{name} = {std_devs(values)}" for name, values in channels.items()]
    return "\n".join(["", "[noise]", *lines])


def std_devs(values: Array) -> list[float]:
    """Of each column."""
    return (LEVEL * np.abs(values).max(axis=0)).tolist()


if __name__ == "__main__":
    main()
