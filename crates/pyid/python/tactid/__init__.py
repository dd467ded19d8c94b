"""Identifies what a robot is holding: mass, centre of mass and inertia of a grasped payload.

:func:`identify` takes a log or arrays; :class:`Identifier` takes samples one at a time. A robot is
read from a URDF, and its dynamics are computed on whole arrays. SI units everywhere; each argument
says its frame and its sign.

>>> import numpy as np
>>> import tactid
>>> pendulum = tactid.Manipulator.from_urdf('''
...     <robot name="pendulum">
...       <link name="base"/>
...       <link name="arm"><inertial><origin xyz="0 0 -0.5"/><mass value="2"/>
...         <inertia ixx="0.1" ixy="0" ixz="0" iyy="0.1" iyz="0" izz="0.1"/></inertial></link>
...       <joint name="hinge" type="continuous">
...         <parent link="base"/><child link="arm"/><axis xyz="0 1 0"/></joint>
...     </robot>''', base="fixed")
>>> q = [[0.0], [np.pi / 2]]  # hanging, and level on the side of -x
>>> torques, _ = pendulum.inverse_dynamics(q, gravity=[0, 0, -9.81])
>>> print(np.round(torques[:, 0], 3) + 0.0)  # N m: what holds it up
[0.   9.81]

The parameters of a body, and the wrench that moves it:

>>> payload = tactid.MassProperties(mass=100, com=[0.5, 0, 0], inertia=np.diag([10, 20, 10]))
>>> print(payload.parameters[7])  # Iyy about the frame's origin: 20 + 100 * 0.5**2
45.0
>>> rows = tactid.wrench_regressor([0, 0, 9.81], [0, 0, 0], [0, 0, 0])
>>> force_and_moment = rows @ payload.parameters
>>> print(np.round(force_and_moment, 3) + 0.0)
[   0.     0.   981.     0.  -490.5    0. ]

The paper's experiment, and the payload from its log::

    tactid.simulate(tactid.Experiment.paper(), "run.mcap")
    estimate = tactid.identify("run.mcap", estimator="least-squares").estimate
    print(estimate.body)
"""

# isort: off
from tactid._base import startup as _startup  # noqa: F401 - first: Ctrl-C while the others load

# isort: on
import lazy_loader as _lazy_loader

# Each public name, of which the stub `__init__.pyi` says the module, is imported when it is used.
__getattr__, __dir__, __all__ = _lazy_loader.attach_stub(__name__, __file__)
