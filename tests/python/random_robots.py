"""Robots that nobody designed: URDFs with branches and every kind of joint."""

import numpy as np


def random_urdf(rng: np.random.Generator, links: int) -> str:
    """A tree of links; each hangs below any earlier one by a joint of any kind."""
    names = [f"link_{name}" for name in rng.permutation(links)]
    parts = [_link(rng, names[0], with_mass=True)]
    for index in range(1, links):
        kind = rng.choice(["revolute", "continuous", "prismatic", "fixed"])
        parent = names[rng.integers(index)]
        # A link on a fixed joint may be a mere frame.
        parts.append(_link(rng, names[index], with_mass=kind != "fixed" or rng.random() < 0.5))
        parts.append(
            _joint(rng, f"joint_{rng.integers(10**6)}_{index}", kind, parent, names[index])
        )
    return f'<robot name="random">{"".join(parts)}</robot>'


def _numbers(values: np.ndarray) -> str:
    return " ".join(repr(float(value)) for value in values)


def _origin(rng: np.random.Generator) -> str:
    xyz, rpy = rng.uniform(-0.6, 0.6, 3), rng.uniform(-1.5, 1.5, 3)
    return f'<origin xyz="{_numbers(xyz)}" rpy="{_numbers(rpy)}"/>'


def _link(rng: np.random.Generator, name: str, *, with_mass: bool) -> str:
    if not with_mass:
        return f'<link name="{name}"/>'
    mass = rng.uniform(0.1, 20)
    points = rng.normal(size=(8, 3)) * rng.uniform(0.05, 0.4, 3)
    points -= points.mean(axis=0)
    second = mass / 8 * points.T @ points
    i = np.trace(second) * np.eye(3) - second
    entries = {"ixx": (0, 0), "ixy": (0, 1), "ixz": (0, 2), "iyy": (1, 1), "iyz": (1, 2)}
    entries["izz"] = (2, 2)
    inertia = " ".join(f'{key}="{float(i[at])!r}"' for key, at in entries.items())
    return (
        f'<link name="{name}"><inertial>{_origin(rng)}<mass value="{mass!r}"/>'
        f"<inertia {inertia}/></inertial></link>"
    )


def _joint(rng: np.random.Generator, name: str, kind: str, parent: str, child: str) -> str:
    axis = rng.normal(size=3)
    axis /= np.linalg.norm(axis)
    limit = '<limit lower="-3" upper="3" effort="1" velocity="1"/>'
    return (
        f'<joint name="{name}" type="{kind}">{_origin(rng)}<parent link="{parent}"/>'
        f'<child link="{child}"/><axis xyz="{_numbers(axis)}"/>{limit}</joint>'
    )
