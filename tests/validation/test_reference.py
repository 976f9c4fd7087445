"""The flat model in one file against the assembled one, which has other beams, another integrator and other code."""

import numpy as np
import pytest
from bundled import bundled
from gliding import model as glider
from gliding import standing
from scipy.spatial.transform import Rotation

from sssi_exudyn.bodies.ski.mesh import mesh
from sssi_exudyn.bodies.ski.modes import modal_ski
from sssi_exudyn.contact.registry import PAPER_TERMS
from sssi_exudyn.contact.terms.wind import Wind
from sssi_exudyn.model.from_recording import model_of
from sssi_exudyn.model.model import Model
from sssi_exudyn.motion.motion import Motion
from sssi_exudyn.simulation.full.forces import Forces
from sssi_exudyn.simulation.full.forces_kernel import ACROSS, ALONG, LOAD, NODE
from sssi_exudyn.simulation.full.run import simulate
from sssi_exudyn.simulation.full.system import instant
from sssi_exudyn.simulation.ski_on_snow.structs import Carrier
from sssi_exudyn.validation.reference import FlatModel, flat_ski, simulate_flat


def bundled_model(name: str) -> tuple[Model, Motion]:
    recording, motion = bundled(name)
    return model_of(recording, motion), motion


@pytest.mark.parametrize(
    ("name", "begin", "friction", "velocity"),
    [("beginner", 2.0, (0.06, 0.55), (5.0, 1.0)), ("intermediate", 4.0, (0.19, 0.9), (8.5, 5.7))],
)
@pytest.mark.long
def test_the_assembled_model_is_the_flat_one(
    name: str, begin: float, friction: tuple[float, float], velocity: tuple[float, float]
) -> None:
    """Simulate half a second of a turn, the intermediate's with an edge change; both start at rest on the snow."""
    model, motion = bundled_model(name)
    numbers = ("friction.mu_t", "friction.mu_n", "start.velocity_f", "start.velocity_l")
    model = model.with_values(dict(zip(numbers, (*friction, *velocity), strict=True)))
    full = simulate(model, motion, start=begin, stop=begin + 0.5)
    flat = simulate_flat(model, motion, begin, begin + 0.5, full.pelvis[0], full.pelvis_velocity[0])
    pelvis, loads = (
        np.stack([np.interp(full.time, flat["time"], column) for column in flat[key].T], axis=1)
        for key in ("pelvis", "foot_load")
    )
    # 0.6 mm of 2.5 and 5 m of path, seen 0.31 and 0.37: what the vibrations left out would have given way by (with 12
    # instead of 8 it is 0.2 mm, with skis ten times as stiff 0.1 mm)
    assert np.max(np.abs(pelvis - full.pelvis)) < 6e-4
    # 1 % of the load once the skis' first swing has died out, by the same stiffness
    weight = full.foot_load.sum(axis=1).mean()
    assert np.max(np.abs(loads - full.foot_load)[full.time > begin + 0.1]) < 0.01 * weight
    # it is a turn that is compared: the feet turn, and the pelvis is pushed off its straight line
    straight = full.pelvis[0] + np.outer(full.time - begin, full.pelvis_velocity[0])
    assert np.max(np.abs(pelvis - straight)[:, 1]) > 100 * 6e-4


@pytest.mark.parametrize("above", [1.0, 0.0, -0.02, -0.05, -0.1])
@pytest.mark.parametrize("name", ["beginner", "intermediate"])
def test_the_same_forces_where_the_skis_are_the_same(name: str, above: float) -> None:
    """Compare unbent skis, which have the same masses and contact points in both: so have their forces, to rounding.

    Feet ``above`` the snow (m), at a random time and speed: in the air, on the shovels, deep.
    """
    generator = np.random.default_rng(round(1000 * above) + 200)
    model, motion = bundled_model(name)
    flat = FlatModel(model, motion)
    parts = flat.parts
    time = generator.uniform(motion.start, motion.stop, 1)
    posture = parts.posture(time)
    ours = flat.posture(time)[0]
    theirs = instant(posture, 0)
    x, v = generator.normal(size=(2, 3))
    x[2] = above - posture.foot_place[0, :, 2].mean()
    nodes = np.concatenate(
        [
            parts.mesh.node_position + parts.ski_in_foot,
            Rotation.from_matrix(parts.mesh.node_rotation).as_quat(scalar_first=True),
        ],
        axis=1,
    )
    q = np.concatenate([x, nodes.ravel(), nodes.ravel()])
    rates = np.concatenate([v, np.zeros(2 * NODE * len(nodes))])
    forces = Forces(model.terms, parts.sections, Carrier(np.ones(3), flat.area, flat.gravity), np.zeros(len(q)))
    theirs = theirs._replace(
        foot_jacobian=theirs.foot_jacobian[..., :0],
        com_jacobian=theirs.com_jacobian[..., :0],
        exposed_jacobian=theirs.exposed_jacobian[..., :0],
    )
    expected = forces.evaluate(q, rates, theirs)[:3]
    none = np.zeros((2, len(flat.ski.omega)))
    loads, rubs, total, _ = flat.pushes(ours, x, v, none, none)
    largest = max(np.abs(expected).max(), 1.0)
    # 1e-9 of the force, for rounding in a sum of two hundred points; 1e-12 m/s is what the assembled air adds at rest
    np.testing.assert_allclose(loads, forces.seen[:, LOAD], rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(total, expected, atol=1e-9 * largest)
    np.testing.assert_allclose(flat.drag(ours, v), forces.drag[:, :3].sum(axis=0), rtol=1e-9)
    np.testing.assert_allclose(
        np.linalg.norm(rubs, axis=1), np.hypot(*forces.seen[:, [ALONG, ACROSS]].T), rtol=1e-9, atol=1e-9
    )
    assert (loads.sum() > 0.0) == (above < 0.5)


def test_the_flat_skis_vibrations_are_the_frames() -> None:
    flat = FlatModel(*bundled_model("beginner"))
    ski = flat_ski(flat.parts)
    frame = modal_ski(mesh(flat.parts.model.ski, 50), 12).frequency
    # every one of the flat ski's is in the frame, which also bends sideways: 4 % for shear, lumped masses and
    # a shovel that is not shallow
    for frequency in ski.omega / (2.0 * np.pi):
        assert np.min(np.abs(frame / frequency - 1.0)) < 0.04
    # one kilogram each, whatever kind it is
    moving = np.einsum("n,nik,nil->kl", ski.mass, ski.shape, ski.shape)
    moving += np.einsum("n,nk,nl->kl", ski.turning_mass, ski.twist, ski.twist)
    # 5 %: bending's sections turn about the ski's width as well, and a rising ski moves along itself
    np.testing.assert_allclose(moving, np.eye(len(moving)), atol=0.05)


def test_the_flat_model_knows_the_papers_terms_alone() -> None:
    with pytest.raises(ValueError, match="paper's terms"):
        FlatModel(glider((*PAPER_TERMS, Wind())), standing(0.1))
