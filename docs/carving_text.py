"""What ``docs/make_carving.py`` writes about its figures."""

TEXT = """# Carving

Made by `PYTHONPATH=tests/support/models python docs/make_carving.py`.

In the paper the snow's friction acts at the foot: it knows no edge, no yaw moment and no groove. Here is the law of an edge
that cuts, and a rig that runs one ski on it, so that skis can be compared:

```sh
sssi ski turn slalom_165 fischer_rc4_sc_165 --edge 30:70 --speed 10 --out skis.html
```

`--edge` takes one angle, several (`30,45,60`) or a range (`30:70:5`), `--load` the load along the snow's normal,
`--json FILE` writes `ski`, `edge_deg`, `radius_m`, `radius_low_m`, `radius_high_m` and `side_reserve` for each ski and
angle, `null` where the ski slips out of the turn. A ski is one of the catalogue or a file of that form.

## The law

`{formula}`

Each section of the ski presses with its wetted area times the snow's hardness; its deeper edge is held by the wall of the
groove, whose strength is in proportion to depth, and slips where that is not enough; friction is on the resultant of both.
The tangent of every edge point is its own: sidecut, bend and twist turn it, and so steer the ski. There is no yaw moment
besides. The snow remembers two numbers for each edge point, which move towards the tail as the ski moves on: how deep the
groove is that arrives from ahead, and how far the edge is from its wall. A point that rises from the groove's floor by
more than the snow springs back presses no more. Sideslip leaves the groove behind.

The groove has the ski's own shape: one wall as steep as the base, the other square to it. An edge that has risen by r is
r·tanθ away from the latter and, as the snow under the base springs back by δ, (r − δ)₊·cotθ from the base's: that much play it
has before a wall takes hold of it. A wall can push and not pull. Without play the radius fell in steps ([below](#the-plateau-of-the-radius)).

| parameter | default | bounds | source |
|---|---|---|---|
{parameters}

What arrives at a point is interpolated between the points ahead, where its snow was a step ago. The offset grows by the mean of
how fast the edge drifts at both places, and two fifths of the points lie in the last fifth of the ski: there an edge enters the
snow, and within 0.1 m it is as deep as it gets. With the drift of one place, and points at equal distances, 100 points came out with
a radius 6 % larger than the finest at 60°, and 50 points with one 25 % larger; now these are within 1 %.

The strength by default is that of the firmest snow that Mössner measured: with 2.5e5 Pa, above the middle of his range, the
slalom ski skids at 60° and slips beyond (below), where skiers carve.

## The rig

One ski, held at the boot centre, runs on a plane at a given edge angle of the sole until its turn is steady. The load acts
at the boot centre, and the resultant is square to the base. Sinking, pitch, sideslip, yaw rate and the ski's bend (20
vibrations, 100 points an edge) are found. A mass, an inertia and dampers lead to the steady turn, in which they do nothing. The side reserve is 1 − Σ|q_e|/Σ(S_f·a), the thrown snow apart: the share of the wall's strength along the
edge that is not used.

Bars are one standard deviation of {uncertain}; what they do to the curvature adds up as squares.

`sssi sweep examples/sweep_ski_turn.toml --out DIR` changes sidecut, bending and twisting stiffness from turn to turn
(`docs/sweeps.md`).

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
(`tests/simulation/carving/test_steady_turn.py`). It stays larger than R_sc·cosθ at 45° by a ninth: shovel and tip do press where they enter, on
an inner wall of 0.3 of the strength, and the ski gives sideways by its bending modulus over its whole width; steel edges
make real ones stiffer, by how much was not measured.

## In a run

The figures of this section, of skier, fits and both models, were made before the groove's walls had play and before the edge's tangent climbed
with twist, but for [one recording, both laws](#one-recording-both-laws); those of the rig above and of the tables below are of the present law.

```sh
sssi run FOLDER --snow carving --out DIR        # also sssi fit, sssi simulate
sssi simulate FOLDER --model DIR/model.toml --out DIR2
```

put such snow under a recorded skier, in the place of penetration and friction; in `model.toml` it is `[[term]] name =
"carving"`. Fits search with the reduced model and the full one judges, as ever; the run that is written is the full
model's. `sssi sweep` takes the same term with either tier: `carving.hardness` and so on can be swept, and `equipment.skis`
sets ski against ski. `summary.json` has a group `carving` (the snow's numbers, what they come to as μ_t and μ_n, side
reserve, how the skis yaw, roll, heave and pitch against the feet), and `friction` is null.

The posture is the captured one, and so is the heading unless it is found ([The skier's heading](#the-skiers-heading)). The skis
are free below the feet: against a spring and a damper each they yaw, roll, heave and pitch. In `model.toml` and `equipment.toml`, `cuff_edging` and `cuff_flexion` are what holds them in roll and,
with the ankle's own, in pitch.

| a ski against its foot | spring | source |
|---|---|---|
| yaw | 1000 N m/rad | estimate: with a tenth, a ski that skids spins under the boot, which a leg prevents |
| roll | 600 N m/rad | estimate |
| heave | 40 kN/m | estimate: legs that hop stiffly have 20 to 40 (Farley and Morgenroth, J. Biomech. 32 (1999) 267) |
| pitch | 529 N m/rad | ankle of a standing man 300 (Winter et al., J. Neurophysiol. 80 (1998) 1211), cuff 229 ([Boots](boots.md)) |

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
in them, and leg and firm snow together must give as much. On a recording from a piste nobody knows what the heights have in them.

Steps are 1.25 ms. The reduced model's
skis take them by backward differences of second order. Terms of air, wind, terrain and body
act as always; those that change the paper's friction do not go with it.

A fit seeks μ, and H and S_f with priors of (1 ± 0.4)·10⁸ N/m³ and (4 ± 1)·10⁵ Pa; where their standard errors come out as
large, the recording says nothing of them.

Derivatives are exact: the tangents of groove and offset are carried towards the tail as these are, along the branch that each
point takes.
Where nothing yields between two runs they are within 10⁻⁷ of their difference. Kinks average out, more or less. Over 15 s of the
intermediate, as captured, with steps as in a fit, tangents at the end were held against differences over 0.0003 of μ, 1 kPa of S_f
and 10⁶ N/m³ of H:

{derivatives}
Where they have little in common, a ski is about to let go of its edge, or not, and runs part there by metres within 15 s.

A fit searches with steps of 2.5 ms, 50 points and 8 vibrations, which the full model's run sets right. Its skis' steps are of first
order, which damps more than there is to be damped: with second order, and 1.25 ms, an inner ski of 20 N chatters by 100 N between greatest
and least, and in 1.4 s of that the tangents grow by nine powers of ten. All errors of the
posture are sought, as by the paper's law. With feet that are held in height and pitch no such search converged: on snow that hardly
gives, millimetres and fractions of a degree decide what an edge carries.

Which edge of a ski that lies flat is the deeper one is rounding. Sections whose edges are less than 0.01 mm apart in depth, at the
start or for 10 ms, keep theirs in the full model, so that Newton's method does not go to and fro between them: skis that lie exactly
flat, as no captured ones do, are solved by it, too.

### One recording, both laws

`examples/intermediate`, made in a world of the paper's law, by `sssi run` with and without `--snow carving`:

{laws}

### The skier's heading

A captured posture fits one path. A ski whose radius is 5 % larger comes out of a turn of 90° 4.5° behind the captured heading, which
the leg's spring in yaw alone would take up. So the whole posture may turn about gravity:

```sh
sssi simulate FOLDER --model DIR/model.toml --heading free --out DIR2     # or track; also sssi run and sssi fit
sssi simulate FOLDER --model DIR/model.toml --heading free --balanced --out DIR3
```

| heading | what it is |
|---|---|
| `replay` | the captured one, as ever; whatever moment that takes acts on the skier |
| `track` | held to the captured one by a spring (`stiffness`, 500 N m/rad) and a damper (`damping_ratio`, 0.7 of the critical) |
| `free` | what snow and air make of it: for forecasts, and for ski against ski |

`[heading]` in `model.toml` has `mode`, `stiffness` and `damping_ratio`, a sweep's file `heading = "free"`. With Ψ the turn to the left
from the captured heading, I the inertia of skier and skis in the posture of the moment about the vertical through their centre of
mass, 3 to 8 kg m² there, L the angular momentum that the captured movement has about it, and M the moment of snow and air,

`d/dt (I·Ψ̇ + L) = M − k·Ψ − c·Ψ̇`

with k = c = 0 where it is `free`. All that a posture has turns with Ψ, and its velocities and accelerations are those of a posture
that turns; the pelvis goes where the forces take the centre of mass. Both models take one step after the other: Ψ̇ from the moment at
the step's start, Ψ from that Ψ̇, so that the snow's 10⁶ N/m across an edge neither feeds nor damps the turning; spring and damper are
implicit. The skis count as clamped to the feet in I and L: what a ski that yaws below the foot takes of the momentum, some 5 % of it,
is left out, and so is where a pole takes hold. What inverse dynamics of the full model's run find about gravity is the proof: with
`free`, 4 N m rms from step to step.

{headings}
Over all 15 s the two models of the fit before, with points at equal distances, stayed within 0.1° and 0.15 m with `track`. With `free`
they did within 0.6° for 9 s, by which they were 0.7 m apart; nothing brings the skier back to the captured heading, he was 20 to 40° off
it from turn to turn, and in the last second span round in both models. `free` is for seconds, not for runs. Nor does it repair a posture that does not fit its snow: with
the default snow, for which this capture was not made, 120 N m rms are left over about gravity, and he spins round within two seconds.
Joint moments are inverse dynamics' wherever the heading is found, since the constraints of the skeleton's tree would ring with every
step's change of its rate. In `summary.json`, `carving` has
`heading_rms_deg`, and with `yaw_residual_rms_Nm` and `roll_residual_rms_Nm` the moments left over about gravity and about the way of
the centre of mass: they are large where the posture does not fit the path.

Fits find the heading, too, where the model does. An instant's Ψ, Ψ̇ and Ψ̈ follow from what was before it, so they are three numbers
more by which it is linearised, and every other number moves it through them: derivatives are exact, within 3·10⁻⁵ of differences
where no wall begins to yield. The moment left over about the pelvis turns along; about gravity spring and damper are all of it but
0.8 N m rms (of 25 N m with the captured heading, 3 s of the intermediate), what the skis' own yaw takes. A fit begins with the captured
heading, or snow that is not found yet turns the skier away (a first search was still 7 m off the track after 500 s); once all is estimated it is estimated again with the
spring, which holds a heading that is `free` as well. Of the intermediate, by the reduced model alone, `track` finds μ 0.131 ± 0.004,
H (0.67 ± 0.20)·10⁸ N/m³ and S_f (0.92 ± 0.17)·10⁵ Pa, where with the captured heading H goes to its lower bound; the heading is 1.3° rms off the captured
one, 3.3° at most. It misses the fixes by 0.135 m on average, and does not converge: no step lessens the misfit by what its
linear form promises, 23 %. A track of 15 s depends on the heading less linearly than on the rest, so the captured one stays the default.

`--balanced` seeks a slow lean of the whole posture about the pelvis' forward axis, knots 1 s apart, by the reduced model: it makes
the moment left over about the way small, means over 0.5 s counted in 20 N m and the lean in 5°. The lean turns the skis' edges along
with the skier, and is kept as a correction of the posture in `model.toml`.

### Ski against ski

{against}
With the captured heading the feet point along one way whatever is below them, and no difference is larger than its bar. Where the
skier may turn, what skis do differently adds up, and so does what snow does: of the free rows one difference, that of the longer ski down the
slope, is larger than its bar. With a lean that balances each ski on each snow none is: on this snow, within 4 s, these are no claims about skis.


### How far the two models are apart

Of the intermediate, as captured, with μ = 0.1 and the default snow, whose skis heave and pitch, the antenna's ways, 12 m after 1 s and 41 m after 4 s, differ by

{apart}
What is left between the two is what the full model's step comes to, and two or three times what a hundredth of a number of the snow
does. Nothing is chaotic in that: over 4 s a change of the start stays small. In a step of 1.25 ms the skier goes 15 mm, and the points
at the tip are 8 mm apart; with points at equal distances of 17 mm, and an offset by the drift of one place, the two models were 0.11 m
apart after 4 s, and the full one moved by 0.04 m with half the step, on an edge whose turns were 3 to 6 % off.

Earlier they were 0.09 m apart after 1 s and 0.84 m after 4 s as long as

- the reduced model's skis rolled about the captured foot and not about the boot centre, which heaves: by 15 mm, the force across the
  edge of a ski with 820 N rolled it by 0.75° more than in the full model;
- the full model took yaw, roll and pitch from one rotation's three components: with 10° of yaw and 9° of pitch its roll was 0.7° another;
- the reduced model's skis took steps of first order: these alone are 0.07 m after 1 s and 0.74 m after 4 s, with half the step 0.03 m
  and 0.25 m. It is the vibrations' steps, heave and pitch among them, not those of yaw and roll.

## What it was held against

700 N along the snow's normal and the default snow unless stated otherwise; θ is the edge angle, R the radius, R_sc that of the
sidecut. "Expected" with [Q] is an earlier sketch of the same law, which is no measurement: where both differ, a second
implementation that marches from the tip to the tail (`tests/simulation/carving/test_steady_turn.py`) agrees with the rig: at
30 and 60° within 0.6 % in the load, and within 7 and 0.4 % across, where 0.03 mm of offset from a wall are 30 N.

| case | expected | found | within |
|---|---|---|---|
"""

END = """
## What could not be compared

- Federolf et al. (2010): the radii of his turns stand in tables that were not at hand.
- Mössner's sledge (maximum deviations 0.44 and 0.14 m in turns of 67 and 42 m): its track was not at hand.
- Komissarov (2019), carving only below a slope of 8 to 20°: a whole turn on a slope, which the rig does not run.

## What is sure and what is not

The closed forms, the balance, the energy and the second implementation are sure: the law is computed as it is written. That
snow obeys this law with these numbers is not: hardness and strength of a piste differ by decades, springing back and the
offset at which the wall yields are estimates, and the radius hangs on both where the wall yields. The skis of the shops have
the makers' widths; their stiffness is estimated. So the differences between such skis come from their outlines alone.
Not covered: chatter, the sharpness of the edge, layered snow, the stiff zone under the boot. At low edge angles the radius is
not settled by measurements either.
"""
