"""A scene and an estimate as a recording of Rerun, and the layout in which it is looked at."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from tactid._base.errors import ArgumentError
from tactid._base.files import atomic_path
from tactid._base.naming import abridged
from tactid._base.values import PATHS, UNITS, Array
from tactid._native import VALUE_NAMES
from tactid._view.estimate import Channel, Estimate
from tactid._view.robot import Frame
from tactid._view.scene import Force, Scene
from tactid._view.shapes import Shape

Color = tuple[int, int, int]

TIMELINE = "time"
PAYLOAD: Color = (240, 180, 70)
FORCE: Color = (235, 90, 80)
BONE: Color = (176, 180, 186)
X, Y, Z = (235, 96, 92), (104, 200, 120), (96, 156, 250)
XY, XZ, YZ = (230, 180, 80), (200, 120, 220), (80, 200, 210)

COLORS: tuple[Color, ...] = (PAYLOAD, X, Y, Z, X, XY, XZ, Y, YZ, Z)
"""Of the ten values: red, green and blue for x, y and z."""

GROUPS = (
    ("mass", "mass (kg)", slice(0, 1)),
    ("com", "centre of mass (m)", slice(1, 4)),
    ("inertia", "inertia about it (kg m²)", slice(4, 10)),
)

ARROW = 0.5
"""The longest arrows as a fraction of the scene's radius."""
FLAT = 0.01
"""The least semi-axis that is drawn, as a fraction of the largest: a plate is to be seen, too."""
MOST_CHOICES = 50
"""Frames that an error lists, of which the user chooses one."""
FAULT = 1e12
"""Values that no plot can show beside others."""


def record(
    scene: Scene, estimate: Estimate | None, path: Path, *, name: str, tip: str | None
) -> list[str]:
    """Writes the recording; returns what it does not show, and why."""
    drawing = _Drawing(scene, estimate, tip)
    rr.set_strict_mode(True)  # what cannot be sent is an error, not a warning
    recording = rr.RecordingStream("tactid")
    with atomic_path(path) as temporary:
        recording.save(temporary, default_blueprint=drawing.blueprint(name))
        drawing.send(recording, name)
        recording.flush()
        recording.disconnect()
    return [*scene.notes, *drawing.notes]


def entity(*parts: str) -> str:
    """The path of an entity, whatever characters its parts have."""
    return rr.new_entity_path(list(parts))


def times(seconds: Array) -> list[rr.TimeColumn]:
    """The timeline: s since the scene's start."""
    return [rr.TimeColumn(TIMELINE, duration=seconds)]


def unit(vector: Array) -> Array:
    """The direction of a vector; zero for zero."""
    return vector / max(float(np.linalg.norm(vector)), 1e-12)


def seldom(values: Array) -> Array:
    """Some hundred of many rows."""
    return values[:: max(len(values) // 200, 1)]


def placed(frame: Frame, point: Array) -> Array:
    """A point of a frame in the world, (N, 3)."""
    axis, scalar = frame.quaternion[:, :3], frame.quaternion[:, 3:]
    return frame.position + point + 2 * np.cross(axis, np.cross(axis, point) + scalar * point)


@dataclass(frozen=True)
class _Camera:
    position: Array
    target: Array


class _Drawing:
    """What is sent, and how it is laid out."""

    def __init__(self, scene: Scene, estimate: Estimate | None, tip: str | None) -> None:
        self.scene = scene
        self.estimate = estimate
        self.notes: list[str] = []
        self.tip = self._tip(tip)
        self.radius, self.camera = self._look()

    def _tip(self, given: str | None) -> str | None:
        """The frame that the payload is attached to."""
        frames = self.scene.frames
        frame = given
        if frame is None and self.estimate is not None:
            # A sensor that moves by itself is the only frame there is.
            frame = self.estimate.frame or None
            if not self.scene.is_robot:
                frame = next(iter(frames))
        if frame is not None and frame not in frames:
            known = abridged(list(frames), MOST_CHOICES)
            raise ArgumentError(f"there is no frame {frame}; `tip` is one of {known}", option="tip")
        if frame is None and "tool0" in frames:
            return "tool0"
        return frame

    def _look(self) -> tuple[float, _Camera]:
        """The scene's radius, m, and a place from which it fills the view."""
        frames = list(self.scene.frames.values())
        # The base may be large and far: what matters is the arm, and what it holds.
        clouds = [seldom(frame.position) for frame in frames[1:] or frames]
        first = frames[0].position.mean(axis=0)
        held = frames[0] if self.tip is None else self.scene.frames[self.tip]
        last = held.position.mean(axis=0)
        reach = 0.1
        if self.estimate is not None and np.isfinite(self.estimate.com).all():
            clouds.append(seldom(placed(held, self.estimate.com)))
            ellipsoid = self.estimate.ellipsoid()
            reach = reach if ellipsoid is None else float(ellipsoid[0].max())
        points = np.concatenate(clouds)
        center = (points.min(axis=0) + points.max(axis=0)) / 2
        radius = float(np.linalg.norm(points - center, axis=1).max()) + 0.5 * reach
        # From the side on which the arm is seen at its full length, and from somewhat above.
        along = last - first
        aside = np.array([along[1], -along[0], 0.0])
        if np.linalg.norm(aside) < 1e-3 * radius:
            aside = np.array([0.6, -0.8, 0.0])
        direction = unit(aside) + 0.4 * unit(along) + np.array([0.0, 0.0, 0.45])
        return radius, _Camera(center + 2.2 * radius * unit(direction), center)

    def send(self, recording: rr.RecordingStream, name: str) -> None:
        """Sends all data."""
        recording.send_recording_name(name)
        recording.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        self._send_frames(recording)
        for force in self.scene.forces:
            self._send_force(recording, force)
        if self.tip is not None:
            axes = rr.TransformAxes3D(0.15 * self.radius)
            recording.log(entity("world", self.tip, "axes"), rr.Transform3D(), axes, static=True)
        if self.estimate is not None:
            self._send_payload(recording, self.estimate)
            self._send_history(recording, self.estimate)
            for channel in self.estimate.channels:
                _send_channel(recording, self.estimate.fit_time, channel)
            text = rr.TextDocument(summary(self.estimate, self.notes), media_type="text/markdown")
            recording.log("summary", text, static=True)

    def _send_frames(self, recording: rr.RecordingStream) -> None:
        for name, frame in self.scene.frames.items():
            columns = rr.Transform3D.columns(
                translation=frame.position, quaternion=frame.quaternion
            )
            recording.send_columns(entity("world", name), times(frame.time), columns)
            for number, shape in enumerate(self.scene.shapes.get(name, [])):
                _log_shape(recording, entity("world", name, f"shape_{number}"), shape, self.radius)
            if not self.scene.is_robot and len(frame.time) > 1:
                path = rr.LineStrips3D([frame.position], colors=BONE)
                recording.log("world/path", path, static=True)

    def _send_force(self, recording: rr.RecordingStream, force: Force) -> None:
        strength = np.linalg.norm(force.vector, axis=1)
        typical = float(np.percentile(strength, 99)) if len(strength) else 0.0
        if typical == 0:
            return
        # One scale for all, so that arrows can be compared.
        largest = max(
            float(np.percentile(np.linalg.norm(other.vector, axis=1), 99))
            for other in self.scene.forces
            if len(other.vector)
        )
        path = entity("world", force.frame, f"force {force.topic.strip('/').replace('/', ' ')}")
        style = rr.Arrows3D.from_fields(colors=FORCE, radii=0.02 * self.radius, show_labels=True)
        recording.log(path, style, static=True)
        arrows = force.vector * (ARROW * self.radius / largest)
        # Fingers press from outside: their arrows end at the pads. One sensor's begins there.
        pressing = len(self.scene.forces) > 1
        columns = rr.Arrows3D.columns(
            vectors=arrows,
            origins=-arrows if pressing else np.zeros_like(arrows),
            labels=[f"{value:.0f} N" if value >= 100 else f"{value:.2g} N" for value in strength],
        )
        recording.send_columns(path, times(force.time), columns)

    def _send_payload(self, recording: rr.RecordingStream, estimate: Estimate) -> None:
        assert self.tip is not None or not self.scene.frames
        where = self.tip or next(iter(self.scene.frames))
        if not np.isfinite(estimate.com).all():
            self.notes.append("The payload is not shown: its centre of mass is not known.")
            return
        mass = float(estimate.values[0])
        label = f"{mass:.4g} kg" if np.isfinite(mass) else "centre of mass"
        point = rr.Points3D(
            [estimate.com], radii=0.02 * self.radius, colors=PAYLOAD, labels=label, show_labels=True
        )
        recording.log(entity("world", where, "payload", "com"), point, static=True)
        found = estimate.ellipsoid()
        if found is None:
            why = (
                "no body has this mass and inertia"
                if np.isfinite(estimate.values).all()
                else "its mass and inertia are not all known"
            )
            self.notes.append(f"Of the payload only the centre of mass is shown: {why}.")
            return
        axes, directions = found
        ellipsoid = rr.Ellipsoids3D(
            half_sizes=[np.maximum(axes, FLAT * axes.max())],
            colors=(*PAYLOAD, 150),
            fill_mode=rr.components.FillMode.TransparentFillMajorWireframe,
        )
        placed = rr.Transform3D(translation=estimate.com, mat3x3=directions)
        path = entity("world", where, "payload", "ellipsoid")
        recording.log(path, placed, ellipsoid, static=True)

    def _send_history(self, recording: rr.RecordingStream, estimate: Estimate) -> None:
        if not len(estimate.history_time):
            return
        # A history without standard deviations has one line for each value.
        with_intervals = bool(np.isfinite(estimate.history_half_width).any())
        for index, path in enumerate(PATHS):
            value, half = estimate.history[:, index], estimate.history_half_width[:, index]
            lines = [value, value - half, value + half] if with_intervals else [value]
            color = COLORS[index]
            faint = (*color, 90)
            style = rr.SeriesLines(
                colors=[color, faint, faint][: len(lines)],
                widths=[2.0, 1.0, 1.0][: len(lines)],
                # One name is one entry of the legend.
                names=[VALUE_NAMES[index], "95 %", "95 %"][: len(lines)],
            )
            values = plottable(np.stack(lines, axis=1))
            _send_lines(recording, entity("estimate", *path), estimate.history_time, values, style)

    def blueprint(self, name: str) -> rrb.Blueprint:
        """The robot large at the left, the curves around it."""
        camera = self.camera
        space = rrb.Spatial3DView(
            origin="/world",
            name=name,
            eye_controls=rrb.EyeControls3D(
                position=camera.position, look_target=camera.target, eye_up=(0.0, 0.0, 1.0)
            ),
            line_grid=rrb.LineGrid3D(visible=self.scene.stands),
        )
        estimate = self.estimate
        root: rrb.Container | rrb.View = space
        if estimate is not None:
            left: list[rrb.Container | rrb.View] = [space, *self._fit_views(estimate)]
            right: list[rrb.Container | rrb.View] = [
                rrb.TextDocumentView(origin="/summary", name="payload"),
                *self._history_views(estimate),
            ]
            root = rrb.Horizontal(
                rrb.Vertical(*left, row_shares=[3.0, 1.0][: len(left)]) if left[1:] else space,
                rrb.Vertical(*right, row_shares=[1.4, 1.0, 1.0, 1.2][: len(right)]),
                column_shares=[3.0, 2.0],
            )
        return rrb.Blueprint(
            root,
            rrb.BlueprintPanel(state="collapsed"),
            rrb.SelectionPanel(state="collapsed"),
            rrb.TimePanel(
                state="collapsed", timeline=TIMELINE, play_state="playing", loop_mode="all"
            ),
        )

    def _history_views(self, estimate: Estimate) -> list[rrb.View]:
        if not len(estimate.history_time):
            return []
        return [
            rrb.TimeSeriesView(
                origin=f"/estimate/{path}",
                name=title,
                axis_y=rrb.ScalarAxis(range=settled_range(estimate, group)),
                plot_legend=rrb.PlotLegend(visible=path != "mass"),
            )
            for path, title, group in GROUPS
        ]

    def _fit_views(self, estimate: Estimate) -> list[rrb.Container]:
        kinds: dict[tuple[str, str], list[Channel]] = {}
        for channel in estimate.channels:
            kinds.setdefault((channel.name.partition(" ")[0], channel.unit), []).append(channel)
        views = [
            rrb.TimeSeriesView(
                origin="/fit",
                contents=[f"+ {entity('fit', channel.name)}" for channel in channels],
                name=f"{kind} ({unit})",
                axis_y=rrb.ScalarAxis(
                    range=widened(
                        np.concatenate([channel.measured for channel in channels]), (0.2, 99.8)
                    )
                ),
            )
            for (kind, unit), channels in kinds.items()
        ]
        return [rrb.Horizontal(*views)] if views else []


def settled_range(estimate: Estimate, group: slice) -> tuple[float, float]:
    """The range of a plot in which the settled values are seen, and not the first wild ones."""
    start, end = estimate.history_time[[0, -1]]
    late = estimate.history[estimate.history_time >= start + 0.1 * (end - start), group]
    half = estimate.half_width[group]
    final = estimate.values[group]
    values = np.concatenate([late.ravel(), final - half, final + half])
    # What is known to a hair is no reason to look at its last digits.
    return widened(values, (2, 98), 0.015 * float(np.nanmax(np.abs(final), initial=0.0)))


def widened(
    values: Array, percentiles: tuple[float, float], least: float = 0.0
) -> tuple[float, float]:
    """The range of most values, with room around it."""
    finite = plottable(values)
    finite = finite[np.isfinite(finite)]
    if not len(finite):
        return -1.0, 1.0
    low, high = (float(value) for value in np.percentile(finite, percentiles))
    room = max(0.15 * (high - low), least) or 0.01 * abs(high) or 1.0
    return low - room, high + room


def plottable(values: Array) -> Array:
    """Values with NaN, a gap in the line, in place of what would hide all others."""
    return np.where(np.abs(values) < FAULT, values, np.nan)


def summary(estimate: Estimate, notes: Iterable[str]) -> str:
    """The payload in words, as Markdown."""
    cells = []
    for name, unit, value, half in zip(
        VALUE_NAMES, UNITS, estimate.values, estimate.half_width, strict=True
    ):
        cells.append(f"{name} | {quantity(value, half)} {unit}")
    frame = f"in `{estimate.frame}`" if estimate.frame else ""
    head = "± 95 %" if np.isfinite(estimate.half_width).any() else ""
    lines = [f"| {frame} | {head} | | {head} |", "|---|---|---|---|"]
    left, right = [*cells[:4], " | ", " | "], cells[4:]
    lines += [f"| {one} | {other} |" for one, other in zip(left, right, strict=True)]
    lines += ["", *(f"- {remark}" for remark in [*notes, *estimate.remarks])]
    return "\n".join(lines)


def quantity(value: float, half_width: float) -> str:
    """A value with as many digits as its interval supports."""
    if not np.isfinite(value):
        return "not identifiable,"
    if not np.isfinite(half_width) or half_width <= 0:
        return f"{value:.5g}"
    decimals = min(max(1 - math.floor(math.log10(half_width)), 0), 6)
    return f"{value:.{decimals}f} ± {half_width:.{decimals}f}"


def _send_channel(recording: rr.RecordingStream, time: Array, channel: Channel) -> None:
    axis = channel.name.rpartition(" ")[2]
    others = (XY, XZ, YZ, X, Y, Z)
    # Joints have no axis: any colour that is always the same will do.
    color = {"x": X, "y": Y, "z": Z}.get(axis, others[sum(axis.encode()) % len(others)])
    style = rr.SeriesLines(
        colors=[(*color, 100), color],
        widths=[3.0, 1.2],
        names=["measured", f"{axis} predicted"],
    )
    lines = plottable(np.stack([channel.measured, channel.predicted], axis=1))
    _send_lines(recording, entity("fit", channel.name), time, lines, style)


def _send_lines(
    recording: rr.RecordingStream, path: str, time: Array, lines: Array, style: rr.SeriesLines
) -> None:
    """Several lines under one entity, (N, lines)."""
    recording.log(path, style, static=True)
    columns = rr.Scalars.columns(scalars=lines.ravel()).partition([lines.shape[1]] * len(lines))
    recording.send_columns(path, times(time), columns)


def _log_shape(recording: rr.RecordingStream, path: str, shape: Shape, radius: float) -> None:
    placed = rr.Transform3D(translation=shape.position, mat3x3=shape.rotation)
    solid = rr.components.FillMode.Solid
    part: rr.AsComponents
    if shape.kind == "box":
        part = rr.Boxes3D(sizes=[shape.size], colors=shape.color, fill_mode=solid)
    elif shape.kind == "cylinder":
        part = rr.Cylinders3D(
            radii=shape.size[0], lengths=shape.size[1], colors=shape.color, fill_mode=solid
        )
    elif shape.kind == "sphere":
        part = rr.Ellipsoids3D(radii=shape.size, colors=shape.color, fill_mode=solid)
    elif shape.kind == "mesh":
        placed = rr.Transform3D(
            translation=shape.position, mat3x3=shape.rotation @ np.diag(shape.size)
        )
        part = rr.Asset3D(path=shape.mesh)
    else:
        strips: Sequence[Array] = [
            np.array([[0.0, 0.0, 0.0], end]) for end in np.reshape(shape.size, (-1, 3))
        ]
        part = rr.LineStrips3D(strips, colors=shape.color, radii=0.015 * radius)
    recording.log(path, placed, part, static=True)
