"""A result in the format of another program, which takes it for right."""

from collections.abc import Sequence
from typing import Protocol, cast

from tactid._base.errors import IdentificationError
from tactid._base.naming import Style, listed, option_name
from tactid._results import controllers, forms
from tactid._results.payload import Payload
from tactid._results.provenance import Sourced, sentence, subtracted, subtracted_body


class Formats:
    """The formats of other programs, for a result that the data do not contradict."""

    def to_urdf(self: "Result", *, accept_contradicted: bool = False) -> str:
        """Returns the payload as the ``<inertial>`` of a URDF's link.

        See :meth:`PayloadEstimate.to_urdf` for the place where it belongs.

        >>> print(result.to_urdf().splitlines()[1])
        <inertial>

        Args:
            accept_contradicted: Whether to return a result that the data contradict, too.

        Raises:
            IdentificationError: A value is unknown, no body can have these values, or the data
                contradict the result.
        """
        return uncontradicted(self, self.estimate.to_urdf(), accept_contradicted)

    def to_mujoco(self: "Result", *, accept_contradicted: bool = False) -> str:
        """Returns the payload as the ``<inertial>`` of a body in MuJoCo's MJCF.

        See :meth:`PayloadEstimate.to_mujoco` for the place where it belongs.

        >>> "fullinertia=" in result.to_mujoco()
        True

        Args:
            accept_contradicted: Whether to return a result that the data contradict, too.

        Raises:
            IdentificationError: A value is unknown, no body can have these values, or the data
                contradict the result.
        """
        return uncontradicted(self, self.estimate.to_mujoco(), accept_contradicted)

    def to_ros(self: "Result", *, accept_contradicted: bool = False) -> str:
        """Returns the payload as a ``geometry_msgs/msg/InertiaStamped`` in YAML.

        >>> print(result.to_ros().splitlines()[0])
        header:

        Args:
            accept_contradicted: Whether to return a result that the data contradict, too.

        Raises:
            IdentificationError: A value is unknown, no body can have these values, or the data
                contradict the result.
        """
        return uncontradicted(self, self.estimate.to_ros(), accept_contradicted)

    def to_controller(
        self: "Result", maker: str | None = None, *, accept_contradicted: bool = False
    ) -> str:
        """Returns what a robot controller asks for, as text with units.

        >>> print(result.to_controller().splitlines()[0])
        payload, in the frame tool0 and along its axes

        Args:
            maker: ``"ur"``, ``"franka"``, ``"kuka"`` or ``"abb"`` for a line of the language of
                that maker's controllers: see :meth:`PayloadEstimate.to_controller`. The payload of
                ``"ur"`` and ``"kuka"`` contains the known tool, and comments say from which
                recording it is.
            accept_contradicted: Whether to return a result that the data contradict, too.

        Raises:
            ArgumentError: The maker is not known.
            IdentificationError: A value that the controller needs is unknown, no body can have
                these values, or the data contradict the result.
        """
        return uncontradicted(self, controller_text(self, maker), accept_contradicted)


class Identified(Protocol):
    """What has a payload: a result of one recording, or of several."""

    @property
    def estimate(self) -> Payload:
        """The payload."""


class Result(Identified, Protocol):
    """A result of one recording, or of several."""

    @property
    def is_contradicted(self) -> bool:
        """Whether the data show the result to be wrong."""

    def worded_remarks(self, style: Style) -> list[str]:
        """Says what a reader must know to trust the result; what shows it to be wrong is first."""


def controller_text(result: Identified, maker: str | None = None) -> str:
    """Returns the payload for a controller, with comments that say where it comes from.

    Where the payload of a maker is everything beyond the flange, it contains the tool that was
    subtracted; a comment says so, or where the tool belongs.
    """
    runs: Sequence[Sourced] = getattr(result, "runs", None) or [cast(Sourced, result)]
    tools = [subtracted_body(run) for run in runs]
    if any(tool != tools[0] for tool in tools):
        raise IdentificationError("no payload for a controller: the recordings have several tools")
    estimate = result.estimate
    tool = None if tools[0] is None else (tools[0], listed(subtracted(runs[0])))
    payload = (estimate.reported_values, estimate.frame, estimate.uncertain, tool)
    sources = [sentence(run) for run in runs]
    if maker is None:
        return "\n".join([forms.controller(*payload), "", *sources])
    first, *line = controllers.controller(maker, *payload).split("\n")
    mark = first.split()[0]
    return "\n".join([first, *(f"{mark} {source}" for source in sources), *line])


def uncontradicted(result: Result, text: str, accepted: bool, style: Style = "keyword") -> str:
    """Returns the text of a result in a format of another program.

    Raises:
        IdentificationError: The data contradict the result, which the user has not ``accepted``.
    """
    if accepted or not result.is_contradicted:
        return text
    option = option_name("accept_contradicted", style)
    raise IdentificationError(
        f"the data contradict the result: {result.worded_remarks(style)[0]} Correct this and"
        f" identify again; {option} gives the result as it is."
    )
