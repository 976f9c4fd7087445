"""Text that ``docs/make_carving.py`` writes about its figures."""

TEXT = """# Carving: figures and trials

Made by `PYTHONPATH=tests/support/models python docs/make_carving.py`.

The law of an edge that cuts is on [its own page](../theory/carving.md), and what to do with it in [the guide](../guide/carving.md). Here is
what it was held against, and what was tried.

## The rig

A mass, an inertia and dampers lead to the steady turn, in which they do nothing; about it an edge that has play swings at 13 to 15 Hz, by 0.03 %
of the yaw rate at most, with 200 points at 30° by 0.6 %. With 100 points the radius is within 0.2 % of that with 400, with 50, 66 and 132
within 1.7 % ([below](#what-it-was-held-against)). The strength by default is that of the firmest snow that Mössner measured: with 2.5e5 Pa,
above the middle of his range, the slalom ski skids at 60° and slips beyond ([below](#what-it-was-held-against)), where skiers carve.

Bars are one standard deviation of {uncertain}; what they do to the curvature adds up as squares.

`sssi sweep examples/sweep_ski_turn.toml --out DIR` changes sidecut, bending and twisting stiffness from turn to turn
(`docs/guide/sweeps.md`).

### The plateau of the radius

As the law was first written, a wall held its edge wherever that was in the snow, and the tangents of a ski that twists left out
that an edge aside of the axis climbs along it. The radius then hardly changed from 30 to 45° and fell all at once above
50°; that of volkl_kendo_184 rose. One thing at a time, slalom_165, 700 N, radius in metres at the edge angle:

{plateau}
Points, steps, vibrations, speed, friction, χ and ρ_s change none of it by more than 1 %, and from above (70 to 30°) the rig finds the
same turns as from below: it is no other branch. What makes it is the wall on the inside. The shovel's taper drives the edge inwards at 1 m/s as
it enters the snow, so that the inner wall yields and keeps pushing it outwards by its strength, ρ_i·S_f·a, 0.7 kN/m at 45°. It pushed so along
all of the shovel, though the edge there was 0.5 to 2.5 mm above the groove's floor and pressed nothing, and at the tail, 160 N in all; the middle
was pushed the other way by as much more. That straightens the path, and it bends the ski sideways in its own plane: the edge itself had
a radius of 10.2 m through tail, middle and tip where R_sc·cosθ is 9.0 m. It grew with the edge angle from 30 to 50°, as the load moves from the middle to
the ends (0.20 to 0.34 m from the boot centre, rms) and back to 0.25 m at 60°, where the edge yields in the middle.

With play, 27 N of that push are left at 45°, and the radius falls from each angle to the next with every ski of the catalogue, 30 to 60°
(`tests/simulation/turns/test_steady_turn.py`). It stays larger than R_sc·cosθ at 45° by a ninth: shovel and tip do press where they enter, on
an inner wall of 0.3 of the strength, and the ski gives sideways by its bending modulus over its whole width; steel edges
make real ones stiffer, by how much was not measured.

## In a run

The posture is the captured one, and so is the heading unless it is found ([The skier's heading](#the-skiers-heading)). The skis
are free below the feet: against a spring and a damper each they yaw, roll, heave and pitch. In `model.toml` and `equipment.toml`, `cuff_edging` and `cuff_flexion` are what holds them in roll and,
with the ankle's own, in pitch.

It heaves along the foot's up axis and yaws about it; there it rolls about its long axis, and then it pitches about the axis across
it: three angles one after the other, of full size, the same in both models.

Dampers have 0.7 of the critical: in heave that of half a skier, 40 kg, who moves over skis that firm snow holds.

A leg at rest is compressed by what it carries, and the capture shows it so; how much belongs to which leg it does not show. At no
force a ski is therefore where the capture has the foot. What both legs carry lowers the pelvis by load/stiffness, 10 mm where
each carries 400 N, less than a fix's height is off. What one carries more makes up for a difference in the feet's captured heights,
so that how stiff the leg is decides the share of the load: of the intermediate's first 5 s, as captured, μ = 0.075, by the reduced
model with steps as in a fit,

{stiffnesses}
That snow is by the paper's law, into which a foot of an edged ski with 700 N sinks 20 mm, 35 kN/m: the recording's heights have that
in them, and leg and firm snow together must give as much. On a recording from a piste it is unknown what the heights contain.

Steps are 1.25 ms. The reduced model's
skis take them by backward differences of second order. Terms of air, wind, terrain and body
act as always; those that change the paper's friction do not go with it.

A fit seeks μ, and H and S_f with priors of (1 ± 0.4)·10⁸ N/m³ and (4 ± 1)·10⁵ Pa; where their standard errors come out as
large, the recording says nothing of them.

Derivatives are exact: the tangents of groove and offset are carried towards the tail as these are, along the branch that each
point takes.
Where nothing yields between two runs they are within 10⁻⁵ of their difference, a share of the greatest value
(`tests/simulation/reduced/test_carved_tangents.py`). Kinks average out, more or less. Over 15 s of the
intermediate, as captured, with steps as in a fit, tangents at the end were held against differences over 0.0003 of μ, 1 kPa of S_f
and 10⁶ N/m³ of H:

{derivatives}
Where they have little in common, a ski is about to let go of its edge, or not, and runs part there by metres within 15 s.

A fit searches with steps of 2.5 ms, 50 points and 8 vibrations, which the full model's run sets right. Its skis' steps are of first
order, which damps more than there is to be damped. All errors of the posture are sought, as by the paper's law.

Which edge of a ski that lies flat is the deeper one is rounding. Sections whose edges are less than 0.01 mm apart in depth, at the
start or for 10 ms, keep theirs in the full model, so that Newton's method does not go to and fro between them: skis that lie exactly
flat, as no captured ones do, are solved by it, too.

### One recording, both laws

`examples/intermediate`, made in a world of the paper's law, by `sssi run` with and without `--snow carving`:

{laws}

### The skier's heading

A captured posture fits one path. A ski whose radius is 5 % larger comes out of a turn of 90° 4.5° behind the captured heading, which
the leg's spring in yaw alone would take up. So the whole posture may turn about gravity:

The skis count as clamped to the feet in I and L: what a ski that yaws below the foot takes of the momentum, some 5 % of it,
is left out, and so is where a pole takes hold. What inverse dynamics of the full model's run find about gravity is the proof: with
`free`, 3 N m rms from step to step.

{headings}
Over the whole run the two models are apart, at most, by

{long_headings}
With `track` the skier is 7.9° off the captured heading at most. With `free` nothing brings him back to it, and the models part: it is for
seconds, not for runs. Nor does it repair a posture that does not fit its snow: with the default snow, for which this capture was not
made, he spins round within two seconds; with its H and S_f, and the μ of the fit, he is 29° off by then, and with the captured heading
94 N m rms are left over about gravity.
Joint moments are inverse dynamics' wherever the heading is found, since the constraints of the skeleton's tree would ring with every
step's change of its rate. In `summary.json`, `carving` has
`heading_rms_deg`, and with `yaw_residual_rms_Nm` and `roll_residual_rms_Nm` the residual moments about gravity and about the direction of
travel: they are large where the posture does not fit the path.

Fits find the heading, too, where the model does. An instant's Ψ, Ψ̇ and Ψ̈ follow from what was before it, so they are three numbers
more by which it is linearised, and every other number moves it through them: derivatives are as exact as with the captured
heading. The moment left over about the pelvis turns along; about gravity spring and damper are all of it but 0.8 N m rms (3 s of the
intermediate, `tests/fitting/test_balance.py`), what the skis' own yaw takes. A fit begins with the captured heading, or snow that is
not found yet turns the skier away; once all is estimated it is estimated again with the spring, which holds a heading that is `free`
as well. `sssi run examples/intermediate --snow carving --heading track` converges over its 15 s: μ 0.143 ± 0.006, H (0.55 ± 0.17)·10⁸
N/m³, S_f (0.85 ± 0.15)·10⁵ Pa, the heading 1.1° rms off the captured one, 11 N m left over about gravity and 55 about the direction of travel, the
track missed by 0.134 m, log evidence −2730 (−2699 with the captured heading), energy within 0.0012 %, in twice the time of that.
The captured one is the default.

`--balanced` seeks a slow lean of the whole posture about the pelvis' forward axis, knots 1 s apart, by the reduced model: it makes
the residual moment about the direction of travel small, means over 0.5 s counted in 20 N m and the lean in 5°. The lean turns the skis' edges along
with the skier, and is kept as a correction of the posture in `model.toml`.

### Ski against ski

{against}
With the captured heading the feet point along one way whatever is below them. fischer_rc4_sc_165, whose radius is 5 % smaller in the
rig, brings the skier nowhere else by more than its bar. volkl_kendo_184, whose radius is larger by half, does: by 0.62 m to the left with
the captured heading, and by 2.9 m down the slope and 4.0 m to the right where the skier turns, and leans as each ski on each snow
balances him. These three are larger than their bars, by no more than a factor of 2.2; where he turns and does not lean so, what is not
known of the snow moves him by more than any ski.

### What it costs

{costs}
### How far the two models are apart

Of the intermediate, as captured, with μ = 0.1 and the default snow, whose skis heave and pitch, the antenna's paths, 12 m after 1 s and 41 m after 4 s, differ by

{apart}
What is left between the two is what half the full model's step changes, and half of what a hundredth of μ or S_f
does, which is less than a recording tells of them. Nothing is chaotic in that: over 4 s a change of the start stays small.

## What it was held against

700 N along the snow's normal and the default snow unless stated otherwise; θ is the edge angle, R the radius, R_sc that of the
sidecut. "Expected" with [Q] is an earlier sketch of the same law, which is no measurement: where both differ, a second
implementation that marches from the tip to the tail (`tests/simulation/turns/test_steady_turn.py`) agrees with the rig in
its mean motion: at 30, 45 and 60° within 0.5 % in the load and within 1.3 % across, with 200 points at 30° within 2.8 %. Out of the motion
of one instant it is off across by up to 5 %, and with 200 points by as much as the force itself: the ski swings, and 0.03 mm of offset from
a wall are 30 N.

| case | expected | found | within |
|---|---|---|---|
"""

END = """
## What could not be compared

- Federolf et al. (2010): the radii of his turns stand in tables that were not at hand.
- Mössner's sledge (maximum deviations 0.44 and 0.14 m in turns of 67 and 42 m): its track was not at hand.

## What is sure and what is not

The closed forms, the balance, the energy and the second implementation are sure: the law is computed as it is written. That
snow obeys this law with these numbers is not: hardness and strength of a piste differ by decades, springing back and the
offset at which the wall yields are estimates, and the radius hangs on both where the wall yields. The skis of the shops have
the makers' widths; their stiffness is estimated. So the differences between such skis come from their outlines alone.
Not covered: chatter, the sharpness of the edge, layered snow, the stiff zone under the boot. At low edge angles the radius is
not settled by measurements either.
"""
