"""A leg of two bones with muscles of every kind, as OpenSim's versions 3 and 4 write it."""

_KNEE_GLIDE = "<SimmSpline><x>-2 -1.2 -0.5 0 0.3</x><y>-0.003 0.004 0.002 0 -0.001</y></SimmSpline>"
_POINTS = {
    "straight": ("PathPoint pelvis -0.05 0.02 0.06", "PathPoint femur -0.02 -0.2 0.01"),
    "conditional": (
        "PathPoint pelvis -0.05 -0.1 0.06",
        "ConditionalPathPoint shank -0.04 -0.02 0.01 knee -0.8 0.2",
        "PathPoint shank -0.02 -0.06 0.0",
    ),
    "moving": ("PathPoint femur 0.03 -0.1 0.0", "MovingPathPoint shank 0.05 0.02 0.0"),
    "round": ("PathPoint pelvis -0.09 0.05 0.08", "PathPoint femur -0.03 -0.22 0.02"),
    "over_ball": ("PathPoint pelvis 0.09 0.05 0.10", "PathPoint femur 0.06 -0.20 0.07"),
    "over_egg": ("PathPoint femur 0.01 -0.25 0.09", "PathPoint shank -0.01 -0.16 0.08"),
}
_WRAPS = {"round": "drum", "over_ball": "ball", "over_egg": "egg"}
_SURFACES = {
    "pelvis": (
        "<WrapCylinder name='drum'><active>true</active><xyz_body_rotation>0.1 -0.2 0</xyz_body_rotation>"
        "<translation>-0.04 -0.06 0.08</translation><quadrant>-x</quadrant><radius>0.05</radius><length>0.4</length>"
        "</WrapCylinder>"
        "<WrapSphere name='ball'><active>true</active><xyz_body_rotation>0 0 0</xyz_body_rotation>"
        "<translation>0.04 -0.07 0.08</translation><quadrant>all</quadrant><radius>0.05</radius></WrapSphere>"
    ),
    "femur": (
        "<WrapEllipsoid name='egg'><active>true</active><xyz_body_rotation>0.3 0 0.2</xyz_body_rotation>"
        "<translation>0 -0.4 0.06</translation><quadrant>z</quadrant><dimensions>0.05 0.08 0.04</dimensions>"
        "</WrapEllipsoid>"
    ),
    "shank": "",
}
_AXES = {
    "hip": (
        ("rotation1", "hip_flexion", "0 0 1", "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"),
        ("rotation2", "hip_adduction", "1 0 0", "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"),
    ),
    "knee": (
        ("rotation1", "knee", "0 0 1", "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"),
        ("rotation2", "rolling", "0 1 0", "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"),
        ("translation1", "knee", "1 0 0", _KNEE_GLIDE),
        ("translation2", "", "0 1 0", "<Constant><value>-0.002</value></Constant>"),
    ),
}
_JOINTS = (
    ("hip", "pelvis", "femur", "-0.07 -0.066 0.083", "0 0.1 0"),
    ("knee", "femur", "shank", "0 -0.4 0", "0 0 0"),
)
_COORDINATES = {"hip": ("hip_flexion", "hip_adduction"), "knee": ("knee", "rolling")}


def _point(text: str, new: bool) -> str:
    tag, bone, x, y, z, *more = text.split()
    body = f"<socket_parent_frame>/bodyset/{bone}</socket_parent_frame>" if new else f"<body>{bone}</body>"
    inside = f"<location>{x} {y} {z}</location>{body}"
    if tag == "ConditionalPathPoint":
        name = f"<socket_coordinate>/jointset/knee/{more[0]}</socket_coordinate>" if new else ""
        inside += (name or f"<coordinate>{more[0]}</coordinate>") + f"<range>{more[1]} {more[2]}</range>"
    if tag == "MovingPathPoint":
        for letter, low, high in (("x", 0.06, 0.04), ("y", 0.0, 0.03), ("z", 0.0, 0.0)):
            coordinate = (
                f"<socket_{letter}_coordinate>/jointset/knee/knee</socket_{letter}_coordinate>"
                if new
                else f"<{letter}_coordinate>knee</{letter}_coordinate>"
            )
            inside += (
                f"{coordinate}<{letter}_location><PiecewiseLinearFunction><x>-2 0.5</x><y>{low} {high}</y>"
                f"</PiecewiseLinearFunction></{letter}_location>"
            )
    return f"<{tag} name='p'>{inside}</{tag}>"


def _muscle(name: str, new: bool) -> str:
    wrap = (
        f"<PathWrap name='w'><wrap_object>{_WRAPS[name]}</wrap_object><range>-1 -1</range></PathWrap>"
        if name in _WRAPS
        else ""
    )
    points = "".join(_point(text, new) for text in _POINTS[name])
    return (
        f"<Thelen2003Muscle name='{name}'><GeometryPath><PathPointSet><objects>{points}</objects></PathPointSet>"
        f"<PathWrapSet><objects>{wrap}</objects></PathWrapSet></GeometryPath>"
        "<max_isometric_force>500</max_isometric_force><optimal_fiber_length>0.1</optimal_fiber_length>"
        "<tendon_slack_length>0.2</tendon_slack_length>"
        "<pennation_angle_at_optimal>0.1</pennation_angle_at_optimal></Thelen2003Muscle>"
    )


def _transform(joint: str, new: bool) -> str:
    axes = ""
    for name, coordinate, axis, function in _AXES[joint]:
        held = function if new else f"<function>{function}</function>"
        axes += (
            f"<TransformAxis name='{name}'><coordinates>{coordinate}</coordinates><axis>{axis}</axis>{held}"
            "</TransformAxis>"
        )
    return f"<SpatialTransform>{axes}</SpatialTransform>"


def _coordinates(joint: str) -> str:
    return "".join(
        f"<Coordinate name='{name}'><default_value>0</default_value></Coordinate>" for name in _COORDINATES[joint]
    )


def _coupler() -> str:
    return (
        "<ConstraintSet><objects><CoordinateCouplerConstraint name='c'><isDisabled>false</isDisabled>"
        "<coupled_coordinates_function><SimmSpline><x>-2 -1 0 1</x><y>0.3 0.2 0 -0.1</y></SimmSpline>"
        "</coupled_coordinates_function><independent_coordinate_names>knee</independent_coordinate_names>"
        "<dependent_coordinate_name>rolling</dependent_coordinate_name><scale_factor>1</scale_factor>"
        "</CoordinateCouplerConstraint></objects></ConstraintSet>"
    )


def _forces(new: bool) -> str:
    return f"<ForceSet><objects>{''.join(_muscle(name, new) for name in _POINTS)}</objects></ForceSet>"


def _wraps(body: str) -> str:
    return f"<WrapObjectSet><objects>{_SURFACES[body]}</objects></WrapObjectSet>"


def version_3() -> str:
    """Return the leg as versions 1.9 to 3.3 write it: a joint stands in the body it carries."""
    bodies = "<Body name='ground'/>"
    bodies += "<Body name='pelvis'><Joint><WeldJoint name='held'><parent_body>ground</parent_body></WeldJoint></Joint>"
    bodies += f"{_wraps('pelvis')}</Body>"
    for joint, parent, child, place, turn in _JOINTS:
        bodies += (
            f"<Body name='{child}'><Joint><CustomJoint name='{joint}'><parent_body>{parent}</parent_body>"
            f"<location_in_parent>{place}</location_in_parent><orientation_in_parent>{turn}</orientation_in_parent>"
            "<location>0 0 0</location><orientation>0 0 0</orientation>"
            f"<CoordinateSet><objects>{_coordinates(joint)}</objects></CoordinateSet>{_transform(joint, False)}"
            f"</CustomJoint></Joint>{_wraps(child)}</Body>"
        )
    return (
        f"<OpenSimDocument Version='30000'><Model name='leg'><BodySet><objects>{bodies}</objects></BodySet>"
        f"{_coupler()}{_forces(False)}</Model></OpenSimDocument>"
    )


def version_4() -> str:
    """Return the leg as version 4 writes it: joints stand apart and join frames offset from bodies."""
    bodies = "".join(f"<Body name='{name}'>{_wraps(name)}</Body>" for name in ("pelvis", "femur", "shank"))
    joints = (
        "<WeldJoint name='held'><socket_parent_frame>/ground</socket_parent_frame>"
        "<socket_child_frame>/bodyset/pelvis</socket_child_frame></WeldJoint>"
    )
    for joint, parent, child, place, turn in _JOINTS:
        joints += (
            f"<CustomJoint name='{joint}'><socket_parent_frame>{parent}_offset</socket_parent_frame>"
            f"<socket_child_frame>/bodyset/{child}</socket_child_frame>"
            f"<coordinates>{_coordinates(joint)}</coordinates>"
            f"<frames><PhysicalOffsetFrame name='{parent}_offset'><socket_parent>/bodyset/{parent}</socket_parent>"
            f"<translation>{place}</translation><orientation>{turn}</orientation></PhysicalOffsetFrame></frames>"
            f"{_transform(joint, True)}</CustomJoint>"
        )
    return (
        f"<OpenSimDocument Version='40000'><Model name='leg'><BodySet><objects>{bodies}</objects></BodySet>"
        f"<JointSet><objects>{joints}</objects></JointSet>{_coupler()}{_forces(True)}</Model></OpenSimDocument>"
    )
