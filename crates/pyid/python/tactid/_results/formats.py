"""A payload in the format of another program, which takes it for right."""

import copy
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

from tactid._base.errors import IdentificationError
from tactid._base.naming import Style, listed, option_name
from tactid._results import controllers, forms, records
from tactid._results.provenance import Sourced, sentence, subtracted, subtracted_body


class Formats(records.Record):
    """The formats of other programs, for an estimate or a result that no data contradict."""

    def __post_init__(self) -> None:
        """Lets the estimate of a result know what was noticed about the data."""
        super().__post_init__()
        if hasattr(self, "estimate"):
            results = (self, *getattr(self, "runs", ()))
            noticed = [finding for each in results for finding in each.findings]
            estimate = copy.copy(self.estimate)
            object.__setattr__(estimate, "_noticed", noticed)
            object.__setattr__(self, "estimate", estimate)

    @property
    def is_contradicted(self) -> bool:
        """Whether the data show the result that has this estimate to be wrong."""
        return any(finding.contradicts_result for finding in vars(self).get("_noticed", ()))

    def to_urdf(self, *, accept_contradicted: bool = False) -> str:
        """Returns the payload as the ``<inertial>`` of a URDF's link.

        The link is one of its own, fixed to the link :attr:`PayloadEstimate.frame` without a
        rotation or an offset. The ``<inertial>`` that this link already has is that of the tool
        and stays as it is: the payload is added to the robot and replaces nothing. See the README
        for the whole. As in every format, a comment names the values that are uncertain.

        >>> print(estimate.to_urdf())
        <!-- payload in the frame tool0: for a link of its own, fixed to tool0 without an offset -->
        <inertial>
          <origin xyz="0.0 0.0 0.1" rpy="0 0 0"/>
          <mass value="1.5"/>
          <inertia ixx="0.02" ixy="0.0" ixz="0.0" iyy="0.03" iyz="0.0" izz="0.04"/>
        </inertial>

        Args:
            accept_contradicted: Whether to return a result that the data contradict, too.

        Raises:
            IdentificationError: A value is unknown, no body can have these values, or the data
                contradict the result.
        """
        return self._in_form(forms.urdf, accept_contradicted)

    def to_mujoco(self, *, accept_contradicted: bool = False) -> str:
        """Returns the payload as the ``<inertial>`` of a body in MuJoCo's MJCF.

        The body is one of its own inside the body :attr:`PayloadEstimate.frame`, without ``pos``
        and ``quat``. The inertial of that body is that of the tool and stays as it is.

        >>> print(estimate.to_mujoco())
        <!-- payload in the frame tool0: for a body of its own inside tool0 without an offset -->
        <inertial pos="0.0 0.0 0.1" mass="1.5" fullinertia="0.02 0.03 0.04 0.0 0.0 0.0"/>

        Args:
            accept_contradicted: Whether to return a result that the data contradict, too.

        Raises:
            IdentificationError: A value is unknown, no body can have these values, or the data
                contradict the result.
        """
        return self._in_form(forms.mujoco, accept_contradicted)

    def to_ros(self, *, accept_contradicted: bool = False) -> str:
        """Returns the payload as a ``geometry_msgs/msg/InertiaStamped`` in YAML.

        The inertia is about the centre of mass, along the axes of :attr:`PayloadEstimate.frame`.

        >>> print(estimate.to_ros().splitlines()[1])
          frame_id: "tool0"

        Args:
            accept_contradicted: Whether to return a result that the data contradict, too.

        Raises:
            IdentificationError: A value is unknown, no body can have these values, or the data
                contradict the result.
        """
        return self._in_form(forms.ros, accept_contradicted)

    def to_controller(self, maker: str | None = None, *, accept_contradicted: bool = False) -> str:
        """Returns what a robot controller asks for, as text with units.

        It gives the centre of mass in m and in mm, and the inertia about the centre of mass and
        about the frame's origin, all along the frame's axes and without exponents. An unknown
        inertia is marked as such, because most controllers accept a payload without one.

        With ``maker``, the text is a line of the language of that maker's controllers. Of a result,
        comments say from which recording it is, and the payload of ``"ur"`` and ``"kuka"``
        contains the known tool.

        >>> print(estimate.to_controller().splitlines()[2])
        mass                 kg  1.50000000
        >>> print(estimate.to_controller("abb").splitlines()[0])
        ! payload for ABB: the frame tool0 must be the coordinate system of the tool in use

        Args:
            maker: ``"ur"`` for URScript's ``set_target_payload``, ``"franka"`` for libfranka's
                ``setLoad``, ``"kuka"`` for KRL's ``LOAD_DATA``, ``"abb"`` for RAPID's ``loaddata``.
            accept_contradicted: Whether to return a result that the data contradict, too.

        Raises:
            ArgumentError: The maker is not known.
            IdentificationError: A value that the controller needs is unknown, no body can have
                these values, or the data contradict the result.
        """
        runs: Sequence[Sourced] = getattr(self, "runs", [self] if hasattr(self, "setup") else [])
        tools = [subtracted_body(run) for run in runs]
        if any(tool != tools[0] for tool in tools):
            raise IdentificationError(
                "no payload for a controller: the recordings have several tools"
            )
        tool = (tools[0], listed(subtracted(runs[0]))) if tools and tools[0] else None
        doubts: str | None = getattr(self, "disagreement", None)
        sources = [*([f"warning: {doubts}"] if doubts else []), *(sentence(run) for run in runs)]
        if maker is None:
            text = self._in_form(partial(forms.controller, tool=tool), accept_contradicted)
            return "\n".join([text, *([""] if sources else []), *sources])
        text = self._in_form(partial(controllers.controller, maker, tool=tool), accept_contradicted)
        first, *line = text.split("\n")
        mark = first.split()[0]
        return "\n".join([first, *(f"{mark} {source}" for source in sources), *line])

    def _in_form(self, form: Callable[..., str], accepted: bool) -> str:
        payload: Any = getattr(self, "estimate", self)
        text = form(payload.reported_values, payload.frame, payload.uncertain)
        return uncontradicted(self, text, accepted)


def uncontradicted(of: Formats, text: str, accepted: bool, style: Style = "keyword") -> str:
    """Returns the text of a payload in a format of another program.

    Raises:
        IdentificationError: The data contradict the result, which the user has not ``accepted``.
    """
    if accepted or not of.is_contradicted:
        return text
    option = option_name("accept_contradicted", style)
    why = "The findings of the identification say why."
    if hasattr(of, "worded_remarks"):
        why = of.worded_remarks(style)[0]
    raise IdentificationError(
        f"the data contradict the result: {why} Correct this and identify again; {option} gives the"
        " result as it is."
    )
