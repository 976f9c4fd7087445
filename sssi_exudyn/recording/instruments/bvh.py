"""Motion capture in Biovision Hierarchy (BVH) files, as Axis Studio exports them.

Centimetres and degrees in the file; metres and rotation matrices here.  Axes stay the file's: x left, y up, z forward.
A joint's local rotation is the product of its channels in the order written, so ``Yrotation Xrotation Zrotation``
means R = R_y R_x R_z; the joint's place in its parent is its OFFSET.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import accumulate
from pathlib import Path
from typing import Final

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from sssi_exudyn.core.errors import InputError
from sssi_exudyn.core.frames import Array
from sssi_exudyn.io.bounds import MAX_JOINTS, MAX_LINES, MAX_NAME
from sssi_exudyn.io.files import read_text
from sssi_exudyn.io.repairs import Mask, Repairs
from sssi_exudyn.io.table import SHORT_GAP, numbers

_SIDES: Final = ("Right", "Left")
LEGS: Final = tuple(side + part for side in _SIDES for part in ("UpLeg", "Leg", "Foot"))
_ARMS: Final = tuple(side + part for side in _SIDES for part in ("Shoulder", "Arm", "ForeArm", "Hand"))
REQUIRED_JOINTS: Final = ("Hips", *LEGS, "Spine", "Spine1", "Spine2", "Neck", "Head", *_ARMS)
"""Joints that every recording must have; ``Neck1``, ``Spine3`` and the fingers are optional."""

_XSENS_SIDED: Final = {
    "Collar": "Shoulder", "Shoulder": "Arm", "Elbow": "ForeArm", "Wrist": "Hand",
    "Hip": "UpLeg", "Knee": "Leg", "Ankle": "Foot", "Toe": "ToeBase",
}  # fmt: skip
_XSENS: Final = {
    "Chest": "Spine", "Chest2": "Spine1", "Chest3": "Spine2", "Chest4": "Spine3",
    **{f"{side}{theirs}": f"{side}{ours}" for side in _SIDES for theirs, ours in _XSENS_SIDED.items()},
}  # fmt: skip
"""Names of a recording's joints by the names that Xsens MVN writes."""
_LONGEST_BONE: Final = 1000.0
"""Largest distance between two joints, m, whatever the unit; ``cross_checks`` judge bones by the skier's height."""
_FARTHEST: Final = 1e5
"""Largest distance of a capture's root from the origin, m."""
_LARGEST_ANGLE: Final = 1e5
"""Largest angle of a channel, degrees; unwrapped angles of a run stay below some thousand."""
_PREFIX: Final = re.compile(r"[^:_]*[:_]")

_FASTEST_JOINT: Final = float(np.deg2rad(1000.0))
"""Angular speed, rad/s, that no joint of a skier's legs reaches; knees of sprinters reach 900 °/s."""
_CUT: Final = 0.1
"""Largest share of the announced frames that may be missing at the end."""
_LEAST_BENT, _MOST_BENT, _LEAST_SWING = 0.5, float(np.pi), 0.3
"""Range of the largest angle of a skier's legs, and least swing of one, where they are in radians.  In degrees such
legs would never bend."""

_FRAME_TIME: Final = (0.0005, 0.05)
"""Shortest and longest plausible frame time, s: 20 Hz is the lowest rate that still carries the filter's 6 Hz."""


@dataclass(frozen=True)
class Bvh:
    """A motion capture: tree, time and rotations, in BVH axes (x left, y up, z forward).

    Attributes
    ----------
    names : the J joints, parents before children
    parents : index of each joint's parent; −1 for the root
    offsets : (J, 3) m, each joint's place in its parent's axes
    end_offsets : (3,) m of each End Site, by the name of its joint
    time : (n,) s on the recording's clock
    rotations : (n, J, 3, 3) local rotations, parent ← joint; the root's are world ← root
    root_position : (n, 3) m; dead reckoning of the capture, not to be used as a measurement
    notes : oddities of the file that do not prevent reading it
    """

    names: tuple[str, ...]
    parents: tuple[int, ...]
    offsets: Array
    end_offsets: dict[str, Array]
    time: Array
    rotations: Array
    root_position: Array
    notes: tuple[str, ...] = ()

    def index(self, name: str) -> int:
        """Return the index of a joint in ``names``; raises KeyError for a joint that is not there."""
        try:
            return self.names.index(name)
        except ValueError:
            raise KeyError(name) from None


@dataclass
class _Tree:
    """The hierarchy while it is being read."""

    names: list[str] = field(default_factory=list)
    parents: list[int] = field(default_factory=list)
    offsets: list[list[float]] = field(default_factory=list)
    ends: dict[str, Array] = field(default_factory=dict)
    channels: list[list[str]] = field(default_factory=list)

    @property
    def first_columns(self) -> list[int]:
        """Return the column of a frame at which each joint's channels begin."""
        return [0, *accumulate(len(channels) for channels in self.channels)][: len(self.channels)]


def read_bvh(path: Path, time_offset: float = 0.0, renamed: Mapping[str, str] | None = None) -> Bvh:
    """Read a BVH file.

    Parameters
    ----------
    path : the file
    time_offset : s, added to the frames' times (frame 0 is at 0 s in the file)
    renamed : the recording's names of joints that have another name in the file (see ``recording_names``)

    A missing tenth at the end, angles in radians and frames in which no one moved (a T-pose at the start) are repaired
    and noted.  Raises InputError for more than that, a frame count that does not match, and text or NaN in a number's
    place.  Raises it too for missing joints, other axes or units, and a joint of the legs or the pelvis that never
    moves.
    """
    path = Path(path)
    lines = read_text(path).split("\n")
    tree, motion_line = _read_hierarchy(path, lines, renamed or {})
    _check_joints(path, tree)
    return _read_frames(path, lines, tree, motion_line, time_offset)


def read_foreign_bvh(path: Path, renamed: Mapping[str, str]) -> Bvh:
    """Read a BVH file of another skeleton: with other joints, axes and unit of length than a recording has.

    Parameters
    ----------
    path : the file
    renamed : the recording's names of the joints, by their names in the file; legs and hips have to be among them

    Joints' axes and offsets stay those of the file, its lengths are taken as centimetres.  Raises InputError as
    ``read_bvh`` does, except for what joints are there and where they are.
    """
    lines = read_text(path).split("\n")
    tree, motion_line = _read_hierarchy(path, lines, renamed)
    missing = [name for name in ("Hips", *LEGS) if name not in tree.names]
    if missing:
        raise InputError(path, "HIERARCHY", f"missing joints: {', '.join(missing)}", "export the whole skeleton")
    return _read_frames(path, lines, tree, motion_line, 0.0)


def _read_frames(path: Path, lines: list[str], tree: _Tree, motion_line: int, time_offset: float) -> Bvh:
    """Read what follows the hierarchy; see ``read_bvh``."""
    frames, frame_time, first = _read_motion_header(path, lines, motion_line)
    width = sum(len(channels) for channels in tree.channels)
    rows = [(number, line) for number, line in enumerate(lines[first - 1 :], first) if line.strip()]
    repairs = Repairs(path)
    if rows and len(rows) <= frames and len(rows[-1][1].split()) < width:  # torn off within a frame
        rows.pop()
    if len(rows) > frames or len(rows) < (1.0 - _CUT) * frames:
        what = "the file is truncated" if len(rows) < frames else "there are more frames than announced"
        raise InputError(
            path,
            f"line {rows[-1][0] if rows else first}",
            f"{what}: the header announces {frames} frames, {len(rows)} are there",
            "export the motion again, or correct 'Frames:' to what is there",
        )
    if len(rows) < frames:
        problem = f"the file is truncated, its header announces {frames} frames,"
        repairs.add_end(problem, f"line {rows[-1][0]}", len(rows))
    values = numbers(path, rows, width, None)
    time = frame_time * np.arange(len(rows), dtype=np.float64)
    bvh = _assemble(path, tree, _in_degrees(tree, values, repairs), time_offset + time)
    moving = _moving_frames(repairs, bvh, _zero_frames(tree, values))
    return replace(moving, notes=(*moving.notes, *repairs.notes))


def recording_names(names: Sequence[str]) -> dict[str, str]:
    """Return a recording's names for the joints of a tree; joints that keep their name are left out.

    A prefix that all joints have is removed (``Robot_``, ``mixamorig:``), and Xsens's names become Axis Studio's.
    """
    prefixes = {match[0] if (match := _PREFIX.match(name)) else "" for name in names}
    cut = len(prefixes.pop()) if len(prefixes) == 1 else 0
    bare = {name: name[cut:] for name in names}
    theirs = _XSENS if _XSENS.keys() <= set(bare.values()) else {}
    ours = {name: theirs.get(short, short) for name, short in bare.items()}
    return {name: ours[name] for name in names if ours[name] != name}


def joint_bones(path: Path) -> tuple[tuple[str, tuple[float, ...]], ...]:
    """Return name and OFFSET of the joints of a BVH file, as they stand there, without any check of the names.

    An OFFSET that is not three numbers is empty.
    """
    bones: list[tuple[str, tuple[float, ...]]] = []
    waiting = False
    for line in read_text(path).partition("MOTION")[0].split("\n"):
        words = line.split()
        key = words[0].upper() if words else ""
        if key in ("ROOT", "JOINT"):
            bones.append((" ".join(words[1:]), ()))
            waiting = True
        elif key == "OFFSET" and waiting:
            bones[-1] = (bones[-1][0], _three_numbers(words[1:]))
            waiting = False
    return tuple(bones)


def _three_numbers(words: Sequence[str]) -> tuple[float, ...]:
    try:
        numbers_there = tuple(float(word) for word in words)
    except ValueError:
        return ()
    return numbers_there if len(numbers_there) == 3 and all(np.isfinite(numbers_there)) else ()


def world_rotations(bvh: Bvh) -> Array:
    """Return the rotations (n, J, 3, 3) world ← joint, in BVH axes."""
    world = np.empty_like(bvh.rotations)
    for joint, parent in enumerate(bvh.parents):
        local = bvh.rotations[:, joint]
        world[:, joint] = local if parent < 0 else world[:, parent] @ local
    return world


def joint_positions(bvh: Bvh, world: Array) -> Array:
    """Return the positions (n, J, 3) m of the joints from the root joint, in the capture's world axes.

    ``world`` is ``world_rotations(bvh)``.
    """
    positions = np.zeros((*world.shape[:2], 3))
    for joint, parent in enumerate(bvh.parents):
        if parent >= 0:
            positions[:, joint] = positions[:, parent] + world[:, parent] @ bvh.offsets[joint]
    return positions


def _zero_frames(tree: _Tree, values: Array) -> Mask:
    """Return in which frames (n,) no joint but the root is turned at all; a sensor's noise alone would turn one."""
    zero = np.ones(len(values), bool)
    for channels, column in zip(tree.channels[1:], tree.first_columns[1:], strict=True):
        for offset, channel in enumerate(channels):
            if channel.endswith("rotation"):
                zero &= values[:, column + offset] == 0.0
    return zero


def _moving_frames(repairs: Repairs, bvh: Bvh, zero: Mask) -> Bvh:
    """Return the capture without frames that are no movement, which are noted.

    Exporters put a T-pose before the first frame, and write zeros where the system lost the skier.  Such frames are cut
    off at the ends, and turned across evenly over up to ``SHORT_GAP`` within.

    Raises InputError for a longer stretch of such frames within, and for more of them than ``Repairs`` allows.
    """
    lost = zero.copy()
    lost[0] |= _jumps(bvh)
    if np.all(zero):
        return bvh
    if not np.any(lost):
        return bvh
    places = [f"frame {number}" for number in range(1, len(lost) + 1)]
    repairs.add_at(
        "frame(s) without movement (T-pose or zeros)", lost, places, done="not used", fix="export the motion again"
    )
    known = np.flatnonzero(~lost)
    longest = int(np.max(np.diff(known)))
    if longest * float(bvh.time[1] - bvh.time[0]) > SHORT_GAP:
        first = int(known[np.argmax(np.diff(known))]) + 1
        problem = f"the {longest - 1} frames from here on are zero"
        raise InputError(repairs.path, places[first], problem, "export the motion without them")
    kept = slice(int(known[0]), int(known[-1]) + 1)
    rotations = bvh.rotations[kept].copy()
    for row in np.flatnonzero(lost[kept]):
        for joint in range(len(bvh.names)):
            after = known[np.searchsorted(known, row + kept.start)] - kept.start
            between = Slerp([row - 1, after], Rotation.from_matrix(rotations[[row - 1, after], joint]))
            rotations[row, joint] = between(row).as_matrix()
    return replace(bvh, time=bvh.time[kept], rotations=rotations, root_position=bvh.root_position[kept])


def _jumps(bvh: Bvh) -> bool:
    """Return whether the legs turn from the first frame to the next as no skier can, and then move on calmly."""
    if len(bvh.time) < 4:
        return False
    legs = [bvh.index(name) for name in LEGS]
    steps = np.swapaxes(bvh.rotations[:3, legs], -1, -2) @ bvh.rotations[1:4, legs]
    angle = np.arccos(np.clip(0.5 * (np.trace(steps, axis1=-2, axis2=-1) - 1.0), -1.0, 1.0))
    speed = np.max(angle, axis=1) / float(bvh.time[1] - bvh.time[0])
    return bool(speed[0] > _FASTEST_JOINT and np.all(speed[1:] < 0.3 * speed[0]))


def _read_hierarchy(path: Path, lines: list[str], renamed: Mapping[str, str]) -> tuple[_Tree, int]:
    """Read the tree and the number (from 1) of the line ``MOTION``."""
    if not lines or lines[0].strip().upper() != "HIERARCHY":
        raise InputError(path, "line 1", "a BVH file starts with HIERARCHY", "export the motion as BVH")
    tree, pending = _Tree(), ""
    stack: list[int] = []
    for number, line in enumerate(lines[1:], 2):
        words = line.split()
        if not words:
            continue
        key = words[0].upper()
        if key == "MOTION":
            if stack or not tree.names:
                raise InputError(path, f"line {number}", "the hierarchy is not closed", "export the motion again")
            return tree, number
        if key in ("ROOT", "JOINT") and len(words) >= 2:
            if (key == "ROOT") == bool(tree.names) or (key == "JOINT" and not (stack and stack[-1] >= 0)):
                raise InputError(path, f"line {number}", "a second root", "export one skier alone")
            pending = renamed.get(" ".join(words[1:]), " ".join(words[1:]))
            if len(pending) > MAX_NAME:
                raise InputError(
                    path, f"line {number}", f"{pending!r} is no name of a joint", "export the motion again"
                )
            if len(tree.names) >= MAX_JOINTS:
                raise InputError(path, f"line {number}", "more joints than any skier has", "export one skier alone")
            if pending in tree.names:
                raise InputError(path, f"line {number}", f"joint {pending!r} appears twice", "export one skier alone")
            tree.parents.append(stack[-1] if stack else -1)
            tree.names.append(pending)
            tree.offsets.append([])
            tree.channels.append([])
        elif key == "END" and stack and stack[-1] >= 0:
            pending = "End Site"
        elif key == "{" and pending:
            stack.append(-1 if pending == "End Site" else len(tree.names) - 1)
            pending = ""
        elif key == "}" and stack:
            stack.pop()
        elif key == "OFFSET" and stack:
            _read_offset(path, number, words, tree, stack)
        elif key == "CHANNELS" and stack and stack[-1] >= 0:
            tree.channels[stack[-1]] = _read_channels(path, number, words)
        else:
            raise InputError(path, f"line {number}", f"{line.strip()[:40]!r} is not BVH", "export the motion again")
    raise InputError(
        path, f"line {len(lines)}", "the file is truncated: it ends without MOTION", "export the motion again"
    )


def _read_offset(path: Path, number: int, words: list[str], tree: _Tree, stack: list[int]) -> None:
    try:
        offset = [float(word) / 100.0 for word in words[1:]]
    except ValueError:
        offset = []
    if len(offset) != 3 or not np.all(np.isfinite(offset)):
        raise InputError(path, f"line {number}", "OFFSET needs three numbers", "export the motion again")
    if max(map(abs, offset)) > (_FARTHEST if stack[-1] == 0 else _LONGEST_BONE):
        raise InputError(
            path, f"line {number}", f"an OFFSET of {max(map(abs, offset)):.3g} m is no bone's", "export in centimetres"
        )
    if stack[-1] >= 0:
        tree.offsets[stack[-1]] = offset
    else:
        tree.ends[tree.names[stack[-2]]] = np.array(offset)


def _read_channels(path: Path, number: int, words: list[str]) -> list[str]:
    channels = [word.lower() for word in words[2:]]
    known = {axis + kind for axis in "xyz" for kind in ("position", "rotation")}
    if len(words) < 2 or words[1] != str(len(channels)) or len(set(channels)) != len(channels) or set(channels) - known:
        raise InputError(
            path,
            f"line {number}",
            f"cannot understand {' '.join(words)[:60]!r}",
            "CHANNELS is followed by a count and as many of Xposition … Zrotation",
        )
    return channels


def _read_motion_header(path: Path, lines: list[str], motion: int) -> tuple[int, float, int]:
    """Read frame count, frame time (s) and the number of the first line of frames."""
    header: dict[str, float] = {}
    number = motion
    while len(header) < 2:
        number += 1
        if number > len(lines):
            raise InputError(path, f"line {len(lines)}", "the file is truncated", "export the motion again")
        line = lines[number - 1].strip()
        if not line:
            continue
        key, _, value = line.partition(":")
        try:
            header[{"frames": "frames", "frame time": "frame time"}[key.strip().lower()]] = float(value)
        except (KeyError, ValueError):
            raise InputError(
                path, f"line {number}", f"expected 'Frames:' and 'Frame Time:', found {line[:40]!r}", "export it again"
            ) from None
    frames, frame_time = header["frames"], header["frame time"]
    if not (2 <= frames <= MAX_LINES and frames == int(frames)):
        raise InputError(path, f"line {motion + 1}", f"{frames:g} frames are no motion", "export the recorded motion")
    if not _FRAME_TIME[0] <= frame_time <= _FRAME_TIME[1]:
        raise InputError(
            path,
            "Frame Time",
            f"{frame_time:g} is outside {_FRAME_TIME[0]:g} to {_FRAME_TIME[1]:g} s",
            "give the frame time in seconds, of 20 Hz or more",
        )
    return int(frames), frame_time, number + 1


def _check_joints(path: Path, tree: _Tree) -> None:
    missing = [name for name in REQUIRED_JOINTS if name not in tree.names]
    if missing:
        fix = "export with Axis Studio's names, or rename the joints to them"
        renamed = recording_names(tree.names)
        if set(REQUIRED_JOINTS) <= {renamed.get(name, name) for name in tree.names}:
            fix = "let sssi import rename them"
        raise InputError(
            path,
            "HIERARCHY",
            f"missing joints: {', '.join(missing)}; found: {', '.join(tree.names[:24])}",
            fix,
        )
    if tree.names[0] != "Hips":
        raise InputError(path, "HIERARCHY", f"the root is {tree.names[0]!r}, not 'Hips'", "export with Hips as root")
    for name, offset, channels in zip(tree.names, tree.offsets, tree.channels, strict=True):
        if not offset:
            raise InputError(path, f"joint {name}", "no OFFSET", "export the motion again")
        rotations = [channel for channel in channels if channel.endswith("rotation")]
        if len(rotations) != 3:
            raise InputError(
                path, f"joint {name}", f"{len(rotations)} rotation channels, not 3", "export all rotation channels"
            )
    place = dict(zip(tree.names, np.array(tree.offsets), strict=True))
    down = [place[side + part] for side in _SIDES for part in ("Leg", "Foot")]
    upright = all(-offset[1] > 0.9 * np.linalg.norm(offset) for offset in down)
    if not upright or place["LeftUpLeg"][0] <= place["RightUpLeg"][0]:
        raise InputError(
            path,
            "OFFSET of the legs",
            "the axes are not x left, y up, z forward (legs must point along −y, the left one at +x)",
            "export with Axis Studio's default axes",
        )


def _in_degrees(tree: _Tree, values: Array, repairs: Repairs) -> Array:
    """Return the channels in degrees: a skier whose knees and hips never move by 3° is written in radians."""
    kinds = [channel for channels in tree.channels for channel in channels]
    owners = [name for name, channels in zip(tree.names, tree.channels, strict=True) for _ in channels]
    turning = np.array([kind.endswith("rotation") for kind in kinds])
    of_legs = turning & np.array([name in LEGS for name in owners])
    bent = float(np.max(np.abs(values[:, of_legs])))
    swing = float(np.max(np.ptp(values[:, of_legs], axis=0)))
    if not _LEAST_BENT < bent < _MOST_BENT or swing < _LEAST_SWING:
        return values
    repairs.add_all(f"no joint of the legs turns by more than {bent:.2f}: the angles are taken as radians")
    values[:, turning] = np.rad2deg(values[:, turning])
    return values


def _assemble(path: Path, tree: _Tree, values: Array, time: Array) -> Bvh:
    offsets = np.array(tree.offsets)
    frames, joints = len(values), len(tree.names)
    rotations = np.empty((frames, joints, 3, 3))
    root_position = np.broadcast_to(offsets[0], (frames, 3)).copy()
    notes: list[str] = []
    frozen: list[str] = []
    moved: list[str] = []
    column = 0
    for joint, (name, channels) in enumerate(zip(tree.names, tree.channels, strict=True)):
        rotation = np.broadcast_to(np.eye(3), (frames, 3, 3))
        position = np.broadcast_to(offsets[joint], (frames, 3)).copy()
        constant = []
        for channel in channels:
            data = values[:, column]
            column += 1
            axis = "xyz".index(channel[0])
            if channel.endswith("position"):
                _check_channel(path, name, channel, data, 100.0 * _FARTHEST)
                position[:, axis] = data / 100.0
            else:
                _check_channel(path, name, channel, data, _LARGEST_ANGLE)
                rotation = rotation @ _about(axis, np.deg2rad(data))
                if np.ptp(data) == 0.0:
                    constant.append(channel)
        rotations[:, joint] = rotation
        if joint == 0:
            root_position = position
        elif np.max(np.abs(position - offsets[joint])) > 1e-4:  # the file's last digit is 0.01 mm
            moved.append(name)
        _check_constant(path, name, constant, frozen, notes)
    if len(frozen) > 0:
        notes.append(f"{path.name}: {', '.join(frozen)} never moves; check the sensors there if that is no surprise")
    if moved:
        notes.append(
            f"{path.name}: positions of {', '.join(moved)} differ from their OFFSET; the OFFSET is used,"
            " as segments are rigid"
        )
    return Bvh(tuple(tree.names), tuple(tree.parents), offsets, tree.ends, time, rotations, root_position, tuple(notes))


def _check_channel(path: Path, name: str, channel: str, data: Array, limit: float) -> None:
    worst = float(np.max(np.abs(data)))
    if worst > limit:
        raise InputError(path, f"joint {name}", f"{channel} reaches {worst:.3g}", "export in centimetres and degrees")


def _check_constant(path: Path, name: str, constant: list[str], frozen: list[str], notes: list[str]) -> None:
    """Judge a joint that never moves: an error where it carries the skis, a note elsewhere; fingers may rest."""
    if name not in REQUIRED_JOINTS or not constant:
        return
    if len(constant) == 3 and name in ("Hips", *LEGS):
        raise InputError(
            path, f"joint {name}", "its rotation is constant: a dead sensor", "repair the capture and export it again"
        )
    if len(constant) == 3:
        frozen.append(name)
    elif name in ("Hips", *LEGS):
        notes.append(f"{path.name}: joint {name}: {', '.join(constant)} is constant; check its sensor")


def _about(axis: int, angle: Array) -> Array:
    """Return rotations (n, 3, 3) by ``angle`` (n,) rad about a coordinate axis."""
    rotation = np.zeros((*angle.shape, 3, 3))
    one, two = (axis + 1) % 3, (axis + 2) % 3
    rotation[:, axis, axis] = 1.0
    rotation[:, one, one] = rotation[:, two, two] = np.cos(angle)
    rotation[:, two, one] = np.sin(angle)
    rotation[:, one, two] = -np.sin(angle)
    return rotation
