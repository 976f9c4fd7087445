"""The Exudyn beam on the bench: statics and vibrations against beam theory."""

import dataclasses
from itertools import pairwise

import exudyn as exu
import numpy as np
import pytest
from exudyn.itemInterface import SensorNode
from scipy.integrate import cumulative_trapezoid, quad
from scipy.linalg import eigh
from scipy.optimize import curve_fit
from scipy.spatial.transform import Rotation
from ski_bench import FLAT, Bench, slalom

from sssi_exudyn.bodies.ski.beam import add_ski_beam
from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.bodies.ski.modes import edge_turning, frame_matrices, modal_ski
from sssi_exudyn.bodies.ski.ski import Ski, uniform_ski

BAR = uniform_ski("bar", length=1.65, width=0.07, thickness=0.01, young_modulus=1e10, mass=1.5)
FLAT_SLALOM = dataclasses.replace(slalom(), height=FLAT)


def integral(ski: Ski, function, start: float, stop: float) -> float:
    """Integrate function(x) dx between two places s on the ski, to 1e-10; quad is given the profiles' break points."""
    cuts = sorted({s for s in (*ski.width.s, *ski.thickness.s) if start < s < stop})
    ends = [start, *cuts, stop]
    parts = [quad(lambda s: function(s * ski.length), a, b, epsrel=1e-10)[0] for a, b in pairwise(ends)]
    return ski.length * sum(parts)


def bent(ski: Ski, left: float, load: float, right: float) -> float:
    """Return the deflection under a unit force at s = load on supports at left and right (m/N): ∫ M²/EI + V²/κGA dx."""
    a, b, c = (s * ski.length for s in (left, load, right))

    def compliance(x: float) -> float:
        shear = (c - b) / (c - a) if x < b else -(b - a) / (c - a)
        moment = shear * (x - a) if x < b else -shear * (c - x)
        s = x / ski.length
        return float(moment**2 / ski.bending_stiffness(s) + shear**2 / ski.shear_stiffness(s))

    return integral(ski, compliance, left, load) + integral(ski, compliance, load, right)


def cantilever(ski: Ski, root: float) -> float:
    """Return the tip's deflection under a unit force there, held at s = root (m/N)."""

    def compliance(x: float) -> float:
        s = x / ski.length
        return float((ski.length - x) ** 2 / ski.bending_stiffness(s) + 1.0 / ski.shear_stiffness(s))

    return integral(ski, compliance, root, 1.0)


# Two-node elements with one integration point: a uniform cantilever of n elements is too stiff by 1/(4 n²), one on
# two supports by 1/n². Here n is what carries the load, 50 elements or the 27 from the boot centre to the tip, and the
# catalogue's sections taper, which at most doubles it. Forces are so small that large deflection adds less than 1e-5.
@pytest.mark.parametrize(
    ("ski", "held", "error"), [(BAR, 0, 1.1 / (4 * 50**2)), (FLAT_SLALOM, 25, 2 / (4 * 25**2))], ids=["bar", "slalom"]
)
def test_cantilever_against_timoshenko(ski: Ski, held: int, error: float) -> None:
    cut = mesh(ski)
    bench = Bench(cut)
    bench.hold(held)
    bench.push(50, [0.0, 0.0, 0.05])
    assert bench.settle()[-1, 2] == pytest.approx(0.05 * cantilever(ski, cut.node_s[held]), rel=error)


@pytest.mark.parametrize(
    ("ski", "ends", "error"), [(BAR, (0, 50), 1.1 / 50**2), (FLAT_SLALOM, (5, 45), 2 / 40**2)], ids=["bar", "slalom"]
)
def test_three_point_bending_against_timoshenko(ski: Ski, ends: tuple[int, int], error: float) -> None:
    cut = mesh(ski)
    bench = Bench(cut)
    bench.hold(ends[0], (1, 1, 1, 1, 0, 1))
    bench.hold(ends[1], (0, 1, 1, 0, 0, 0))
    bench.push(25, [0.0, 0.0, 0.5])
    expected = 0.5 * bent(ski, *cut.node_s[[ends[0], 25, ends[1]]])
    assert bench.settle()[25, 2] == pytest.approx(expected, rel=error)


def test_twist_against_saint_venant() -> None:
    """Twist the tip, the boot centre held: the angle is ∫ dx/GJ, exact for elements of mean compliance."""
    cut = mesh(FLAT_SLALOM)
    bench = Bench(cut)
    bench.hold(cut.clamped)
    bench.twist(50, [0.01, 0.0, 0.0])
    bench.settle()
    turn = bench.mbs.GetNodeOutput(bench.beam.nodes[-1], exu.OutputVariableType.RotationMatrix).reshape(3, 3)
    expected = 0.01 * integral(
        FLAT_SLALOM,
        lambda x: float(1.0 / FLAT_SLALOM.torsional_stiffness(x / FLAT_SLALOM.length)),
        cut.node_s[cut.clamped],
        1.0,
    )
    assert Rotation.from_matrix(turn).as_rotvec() == pytest.approx([expected, 0.0, 0.0], rel=1e-6, abs=1e-8)


def test_rolls_up_into_a_full_circle() -> None:
    """Load a bar with the moment 2π EI/L: it bends into a circle that closes, far beyond small rotations."""
    bench = Bench(mesh(BAR))
    bench.hold(0)
    bench.twist(50, [0.0, -2 * np.pi * float(BAR.bending_stiffness(0.5)) / BAR.length, 0.0])
    place = bench.mesh.node_position + bench.settle(steps=10)
    # A regular polygon of 50 sides closes exactly; 1e-6 m is what the solver's tolerance leaves.
    assert place[-1] == pytest.approx(place[0], abs=1e-6)
    # Half-way round it stands one diameter above: L/π, short by (π/50)²/6 = 7e-4 of a polygon's chord at the most.
    assert place[25, 2] == pytest.approx(BAR.length / np.pi, rel=1e-3)


def test_unloaded_camber_and_shovel_are_free_of_stress() -> None:
    bench = Bench(mesh(slalom()))
    bench.hold(25)
    assert np.abs(bench.settle()).max() < 1e-12  # m; the residual of a stress-free ski is rounding alone


def test_camber_is_pressed_flat_by_the_force_of_beam_theory() -> None:
    ski = slalom()
    cut = mesh(ski, 100)  # so that the ends of the camber, s = 0.04 and 0.93, are nodes
    bench = Bench(cut)
    bench.hold(4, (1, 1, 1, 1, 0, 1))
    bench.hold(93, (0, 1, 1, 0, 0, 0))
    camber = float(ski.height(0.5))
    bench.push(50, [0.0, 0.0, -camber / bent(ski, 0.04, 0.5, 0.93)])
    # 1/89² of discretisation is 1.3e-4; a shallow arch differs from a straight beam by (camber's slope)² ~ 1e-4, and
    # the rollers stand on a running surface sloped by 0.5°, 1e-4 again.
    assert bench.settle(steps=4)[50, 2] == pytest.approx(-camber, rel=1e-3)


def ritz_free_frequencies(ski: Ski, twisting: bool, count: int) -> np.ndarray:
    """Return a free ski's frequencies by Ritz with Legendre polynomials (Euler-Bernoulli, Saint-Venant)."""
    ends = np.unique([*ski.width.s, *ski.thickness.s])
    node, weight = np.polynomial.legendre.leggauss(40)
    s = np.concatenate([0.5 * (a + b) + 0.5 * (b - a) * node for a, b in pairwise(ends)])
    ds = np.concatenate([0.5 * (b - a) * weight for a, b in pairwise(ends)]) * ski.length
    order = 1 if twisting else 2
    polynomials = [np.polynomial.Legendre.basis(k, [0.0, 1.0]) for k in range(30)]
    shape = np.array([p(s) for p in polynomials])
    strain = np.array([p.deriv(order)(s) for p in polynomials]) / ski.length**order
    density = ski.mass_per_length(s)
    if twisting:
        density = density * (ski.width(s) ** 2 + ski.thickness(s) ** 2) / 12.0
    rigidity = ski.torsional_stiffness(s) if twisting else ski.bending_stiffness(s)
    stiffness, mass = (strain * rigidity * ds) @ strain.T, (shape * density * ds) @ shape.T
    squares = eigh(stiffness, mass, eigvals_only=True)[order : order + count]
    return np.asarray(np.sqrt(squares) / (2 * np.pi))


def free_frequencies_by_kind(ski: Ski, elements: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the frequencies of the ski in Exudyn that are nearest to those of Ritz (three bending, one twisting)."""
    frequencies = Bench(mesh(ski, elements)).frequencies()[6:]
    nearest = [frequencies[np.argmin(np.abs(frequencies - f))] for f in ritz_free_frequencies(ski, False, 3)]
    twist = [frequencies[np.argmin(np.abs(frequencies - f))] for f in ritz_free_frequencies(ski, True, 1)]
    return np.array(nearest), np.array(twist)


def test_ritz_gives_the_closed_form_of_a_uniform_bar() -> None:
    beta = np.array([4.730041, 7.853205, 10.995608])
    stiffness = float(BAR.bending_stiffness(0.5))
    closed = beta**2 / (2 * np.pi * BAR.length**2) * np.sqrt(stiffness * BAR.length / BAR.mass)
    assert ritz_free_frequencies(BAR, False, 3) == pytest.approx(closed, rel=1e-6)  # the digits of beta


@pytest.mark.parametrize("ski", [BAR, FLAT_SLALOM], ids=["bar", "slalom"])
def test_free_frequencies(ski: Ski) -> None:
    """Compare the free ski's first three bending frequencies and its first twisting one."""
    bending, twisting = free_frequencies_by_kind(ski, 100)
    # Elements with linear shapes overestimate by (βL/n)²/24 to /12 = 1e-3 in the third mode at n = 100; shear and
    # rotary inertia, which Ritz leaves out, take 1e-4 (bar) to 2e-3 (slalom).
    assert bending == pytest.approx(ritz_free_frequencies(ski, False, 3), rel=3e-3)
    # Twisting has neither: 1e-3 for discretisation and the section's warping-free inertia at n = 100.
    assert twisting == pytest.approx(ritz_free_frequencies(ski, True, 1), rel=1e-3)


@pytest.mark.parametrize("ski", [BAR, FLAT_SLALOM], ids=["bar", "slalom"])
def test_linear_frame_has_the_free_frequencies_too(ski: Ski) -> None:
    stiffness, mass = frame_matrices(mesh(ski))
    squares = eigh(stiffness, mass, eigvals_only=True, subset_by_index=[6, 20])
    frequencies = np.sqrt(squares) / (2 * np.pi)
    for twisting, count in ((False, 3), (True, 1)):
        for wanted in ritz_free_frequencies(ski, twisting, count):
            # 2e-3 for shear and rotary inertia as above, 1e-3 for 50 pieces of even section.
            assert np.abs(frequencies / wanted - 1.0).min() < 3e-3


def test_modal_ski_has_the_frequencies_of_the_held_beam() -> None:
    cut = mesh(slalom(), 100)
    bench = Bench(cut)
    bench.hold(cut.clamped)
    beam, modal = bench.frequencies()[:10], modal_ski(cut, 10).frequency
    # The frame's cubic elements are converged; the beam's linear ones are off by (βL/n)²/24 with n = 50 to a half,
    # βL = 7.85 in the third bending: 1e-3, and up to three times that where the section tapers to the tip.
    assert beam == pytest.approx(modal, rel=4e-3)


def test_modal_ski_sags_like_a_beam_under_steady_acceleration() -> None:
    """Accelerate the ski, held at the boot centre: it bends as a cantilever under its own weight."""
    ski = FLAT_SLALOM
    modal = modal_ski(mesh(ski), 12)
    boot = float(ski.s_of_x(0.0))
    s = np.linspace(boot, 1.0, 20_001)  # sums over steps of 45 µm are right to 1e-7
    x = (s - boot) * ski.length
    for a_z, alpha_y in ((5.0, 0.0), (0.0, 20.0)):
        load = -ski.mass_per_length(s) * (a_z - alpha_y * x)  # against the upward acceleration of the section
        beyond = np.trapezoid(load, x) - cumulative_trapezoid(load, x, initial=0.0)
        moment = np.trapezoid(beyond, x) - cumulative_trapezoid(beyond, x, initial=0.0)
        sag = np.trapezoid((x[-1] - x) * moment / ski.bending_stiffness(s), x)
        base = np.array([0.0, 0.0, a_z, 0.0, alpha_y, 0.0])
        amplitude = -(modal.participation @ base) / (2 * np.pi * modal.frequency) ** 2
        # Twelve modes leave 2e-3 of the static shape out, even sections and no shear 1e-3.
        assert amplitude @ modal.shape[:, -1, 2] == pytest.approx(sag, rel=4e-3)


def test_a_boot_centre_on_stiff_springs_is_held_and_on_soft_ones_swings() -> None:
    cut = mesh(slalom())
    held, stiff = modal_ski(cut, 8), modal_ski(cut, 8, (1e9, 1e7))
    # the springs' compliance against the ski's, some kN/m and N m/rad: 10⁻⁴ and less
    np.testing.assert_allclose(stiff.frequency, held.frequency, rtol=1e-4)
    np.testing.assert_allclose(np.abs(stiff.participation), np.abs(held.participation), atol=1e-3)
    np.testing.assert_allclose(stiff.damping_ratio, held.damping_ratio, rtol=1e-4)
    assert np.all(held.held == 0.0)
    # a ski that hardly bends on its springs is a rigid body on them
    springs = (10.0, 1.0)
    soft = modal_ski(cut, 8, springs)
    place = cut.node_position - cut.node_position[cut.clamped]
    rigid = np.zeros((2, *soft.shape.shape[1:]))
    rigid[0, :, 2], rigid[1, :, 0], rigid[1, :, 2], rigid[1, :, 4] = 1.0, place[:, 2], -place[:, 0], 1.0
    mass = rigid.reshape(2, -1) @ frame_matrices(cut)[1] @ rigid.reshape(2, -1).T
    slow = np.sqrt(np.sort(np.linalg.eigvals(np.linalg.solve(mass, np.diag(springs))).real)) / (2.0 * np.pi)
    # it bends by 10⁻⁵ of how far it swings: the springs against its own bending stiffness, some kN/m
    np.testing.assert_allclose(soft.frequency[:2], slow, rtol=3e-3)
    amplitude = soft.held / (2.0 * np.pi * soft.frequency[:, None]) ** 2
    # what the boot centre gives to a force and to a moment there: the springs' compliance, whatever the ski
    np.testing.assert_allclose(soft.held.T @ amplitude, np.diag([0.1, 1.0]), rtol=1e-3, atol=1e-5)


def test_modal_contact_points_move_as_the_mesh_says() -> None:
    cut = mesh(slalom())
    modal = modal_ski(cut, 8)
    small = 1e-6

    def moved(step: float, shape: np.ndarray) -> np.ndarray:
        turned = Rotation.from_rotvec(step * shape[:, 3:]).as_matrix() @ cut.node_rotation
        return cut.contact_positions(cut.node_position + step * shape[:, :3], turned)

    for shape, expected in zip(modal.shape, modal.contact_shape, strict=True):
        # Central differences: small² · |rotation|³ · arm ~ 1e-12 · 1e5 · 0.05 of their own, rounding 1e-16/1e-6.
        assert (moved(small, shape) - moved(-small, shape)) / (2 * small) == pytest.approx(expected, abs=1e-7)


@pytest.mark.long
def test_free_decay_has_the_declared_damping() -> None:
    ski = slalom()
    cut = mesh(ski)
    bench = Bench(cut, damped=True)
    bench.hold(cut.clamped)
    load = bench.push(50, [0.0, 0.0, 2.0])
    tip = bench.mbs.AddSensor(
        SensorNode(
            nodeNumber=bench.beam.nodes[-1], storeInternal=True, outputVariableType=exu.OutputVariableType.Displacement
        )
    )
    bench.mbs.Assemble()
    settings = exu.SimulationSettings()
    settings.staticSolver.verboseMode = settings.timeIntegration.verboseMode = 0
    settings.solution.file.write = False
    bench.mbs.SolveStatic(settings, updateInitialValues=True)
    bench.mbs.SetLoadParameter(load, "loadVector", [0.0, 0.0, 0.0])
    settings.timeIntegration.endTime, settings.timeIntegration.numberOfSteps = 0.5, 500
    settings.timeIntegration.newton.useModifiedNewton = True
    settings.timeIntegration.newton.absoluteTolerance = 1e-5
    settings.timeIntegration.newton.relativeTolerance = 1e-5
    settings.timeIntegration.generalizedAlpha.spectralRadius = 0.9
    settings.solution.sensors.writePeriod = 1e-3
    bench.mbs.SolveDynamic(settings)
    time, _, _, lift = np.array(bench.mbs.GetSensorStoredData(tip)).T
    late = time > 0.12  # by then the second bending, ζ = 0.22 at 52 Hz, is down by exp(-8.6)

    def decay(t, zeta, omega, c, s, rest):  # type: ignore[no-untyped-def]
        swing = omega * np.sqrt(1 - zeta**2) * t
        return np.exp(-zeta * omega * t) * (c * np.cos(swing) + s * np.sin(swing)) + rest

    (zeta, omega, *_), _ = curve_fit(decay, time[late], lift[late], p0=[0.03, 2 * np.pi * 11, 0.05, 0.0, 0.0])
    modal = modal_ski(cut, 2)
    front = np.argmax(np.abs(modal.shape[:, -1, 2]))
    # The time integration's own damping is (ωh)³/… < 1e-4; the dampers are lumped between nodes, 1/25² of a mode.
    assert zeta == pytest.approx(modal.damping_ratio[front], rel=0.01)
    assert omega / (2 * np.pi) == pytest.approx(modal.frequency[front], rel=3e-3)
    # The front is longer than the back and slower; 5 % of critical is declared for their mean.
    assert np.mean(modal.damping_ratio) == pytest.approx(ski.damping_ratio, rel=1e-6)


def test_a_moving_ski_starts_as_one_rigid_body() -> None:
    cut = mesh(slalom(), 10)
    container = exu.SystemContainer()
    mbs = container.AddSystem()
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("zyx", [0.7, -0.4, 0.2]).as_matrix()
    pose[:3, 3] = [5.0, -3.0, 2.0]
    velocity, spin = np.array([9.0, 1.0, -0.5]), np.array([0.3, -0.8, 1.1])
    beam = add_ski_beam(mbs, cut, pose, velocity, spin)
    mbs.Assemble()
    for node, place, frame in zip(beam.nodes, cut.node_position, cut.node_rotation, strict=True):
        got = {
            name: mbs.GetNodeOutput(node, getattr(exu.OutputVariableType, name))
            for name in ("Position", "Velocity", "AngularVelocity", "RotationMatrix")
        }
        arm = pose[:3, :3] @ place
        assert got["Position"] == pytest.approx(pose[:3, 3] + arm, abs=1e-14)
        assert got["Velocity"] == pytest.approx(velocity + np.cross(spin, arm), abs=1e-13)
        assert got["AngularVelocity"] == pytest.approx(spin, abs=1e-13)
        assert got["RotationMatrix"].reshape(3, 3) == pytest.approx(pose[:3, :3] @ frame, abs=1e-14)
    assert len(beam.elements) == len(beam.dampers) == 10


def test_an_edge_that_lies_aside_climbs_along_a_ski_that_twists() -> None:
    cut = mesh(slalom(), contacts=400)
    modal = modal_ski(cut, 12)
    # of both edges the difference: bending, where shear adds to the sections' turn, moves both alike
    turning, shape = (
        np.subtract(*np.moveaxis(of[..., 2], 2, 0)) for of in (edge_turning(cut, modal), modal.contact_shape)
    )
    climbed = cumulative_trapezoid(turning, cut.ski.x_of_s(cut.contact_s), axis=1, initial=0.0)
    missed = np.abs(climbed - (shape - shape[:, :1])).max(axis=1)
    twists = np.abs(shape).max(axis=1)
    assert np.count_nonzero(twists > 1.0) >= 3
    assert np.all(missed < 0.02 * twists + 1e-9)
