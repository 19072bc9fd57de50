"""Named numbers of the solver, each with its reason."""

DECREMENT = 1e-9
"""Newton decrement relative to the energy at which a step counts as converged: the step that follows squares it."""
ROUND_OFF = 1e-13
"""Energy differences below this fraction of the energy are rounding (1e-16 times a few hundred joints)."""
ENERGY_FLOOR_ANGLE = 1e-7
"""Joint angle, rad, whose bending energy counts as zero: the energy's scale where the energy itself is zero."""
REST_ANGLE = 1e-15
"""Root of the sum of the squared joint angles of an untouched wire, rad, that is rounding: 1e-12 mm at the tip of a
metre of it."""
MEETINGS = 10
"""Halvings of the last half voxel of a wire that springs back to a wall, until it has no more energy than before."""
MOMENT = 1e-5
"""Largest residual moment accepted at a joint, relative to the largest moment in the wire."""
CURVATURE_FLOOR = 1e-6
"""A block of the Hessian within this fraction of its joint's stiffness around zero is neutral, below it indefinite."""
NEUTRAL = 1e-3
"""Negative curvature, over the stiffest joint's stiffness, up to which a wire without moments counts as at rest where
no trial has less energy: turning a joint releases less than a thousandth of what the turn costs by itself."""
SWING = 0.3
"""Angle of the first step off a saddle, rad: there the energy's fourth-order term takes back 1 % of its fall."""
SUFFICIENT = 1e-4
"""Armijo's constant: the fraction of the predicted fall in energy that a step must deliver."""
STEP_ANGLE = 0.7
"""Largest change of a joint in one step, rad: the second-order model of a rotation is good to 10 % there."""
CONTROL_ANGLE = 2.8
"""Largest joint angle kept, rad: the rotation vector is singular at 2 pi and a reversal at pi is a fold."""
FOLD_COSINE = 0.0
"""Two consecutive segments that turn by more than 90 degrees are a fold, not a bend."""
ENTRY_MARGIN_VOXELS = 1.0
"""How far outside the lumen, in voxel diagonals, an entry point may lie before it is called outside."""
SMALLEST_STEP = 2.0**-10
"""Smallest fraction of step_mm that a failing step is halved down to."""
HOP_VOXELS = 0.02
"""Rise of the distance above both ends of a straight path, in voxels, that counts as passing through a wall."""
MOST_JOINTS = 1_000_000
"""Joints of the longest wire that may be asked for: its arrays fill 1.5 GB."""
USUAL_JOINTS = 20_000
"""Joints of the longest wire accepted unless something else is said."""
TURNS_BACK = 2.0
"""Turn of the wire, rad, from which on two strands may meet: on the way pi at least, at a step's end less by what the
step takes off it. Summed as chords, which are 1 % less at 30 degrees a joint."""
PASSAGE_HALVINGS = 30
"""Halvings of a step to find when the ends of two strands lie in one plane: to 1e-9 of it."""
MATCH_DEPTH_MM = 1e-9
"""Depths closer than this are the same depth."""
SAME_LENGTH_MM = 1e-13
"""Difference of two lengths of a first segment that is rounding of the depths they were cut from."""
FIRST_DAMPING = 1e-3
"""Levenberg term tried first: it resists a bend 20 segments long about as much as that bend's own stiffness does."""
LEAST_DAMPING = 1e-7
"""Levenberg term below which it is dropped."""
SOFTER = 0.04
"""Factor from a Levenberg term to the next one tried, where the first held the wire so hard that nothing was left to
gain: the softest mode of k joints is k⁴ times softer than a joint, 4e-11 of it in 400 mm of wire in a sheath."""
WORST_DAMPING = 1e9
"""Levenberg term, relative to the joints' stiffness, at which no useful step is left."""
LESS_DAMPING, AGAIN_DAMPED, MORE_DAMPING = 0.2, 0.5, 6.0
"""Factors on a Levenberg term: after steps that went well; on the last one, where it is needed again after none; and
after a step that was not worth taking."""
SEARCHES, SHORTER = 6, 0.4
"""Step lengths tried before the Levenberg term is raised instead; each over the one before."""
FINE = 1e-5
"""Predicted fall, over the energy, below which whole steps may lead uphill for a while: the shape hardly changes."""
WATCHDOG_STEPS = 8
"""Whole steps that may lead uphill before the energy must be lower than where they began."""
RISE = 0.01
"""How far uphill they may lead, over the energy."""
POLISHES = 20
"""Newton steps taken where the energy is flat to its last digit: each may only halve the remaining decrement where a
stiff wall holds a long lever."""
SLIP_MM = 1e-3
"""Tangential way in mm below which a point in contact still sticks: a thousandth of a usual step."""
FRICTION_CHANGE = 1e-4
"""Relative change of the contact loads at which friction counts as settled."""
TURN_RADIUS_MM = 0.2
"""A contact that turns by FRICTION_CHANGE about a wire of this radius moves by 2 % of SLIP_MM. About a thicker one it
may turn by less, or it would be called settled while its spring is still being stretched."""
FRICTION_SHARES = (0.25, 8.0)
"""Least and greatest share of a change of the contact loads that is taken at once: loads that fell by 0.05 to 0.2 %
from one relaxation to the next, ever faster, had not come to rest after 60."""
FRICTION_FASTER, FRICTION_CREEPS = 1.5, 0.9
"""Factor on the share where a change is more than this part of the one before."""
FRICTION_ROUNDS = 200
"""Relaxations allowed for the contact loads of one step to settle; of a wire that is let go some thirty."""
RUBBING_WAITS = 8
"""Steps with friction that are taken after one that failed before a longer one is tried. In lumens 0.05 to 0.07 mm
wider than the wire every step of 0.1 mm failed, in 200 iterations, and each of half its length took a few: tried after
every single one, they used up what a depth of 4 mm may take."""
PARALLEL = 1e-6
"""Sine of the angle below which a material axis counts as parallel to the wire."""
CLOSED_FORM_ANGLE = 0.2
"""Largest turn of a segment in one sweep of the closed form, rad: its model is linear in the turn."""
CLOSED_FORM_SMALLEST = 1e-12
"""Smallest share of the closed form's own step that is tried before the sweep counts as stalled."""
CLOSED_FORM_IDLE_ANGLE = 3e-11
"""A moment that would turn the stiffest joint by this angle, rad, is nothing: below it the energy by which the closed
form accepts its steps no longer shows them (sqrt(2e-16 u), 1.4e-11 rad in a wire bent by 1e-6 rad a joint)."""
FIRST_CHECK = 32
"""The closed form is asked whether it is at rest before its first sweep, then after a quarter more sweeps than this,
and again after every quarter more."""
SWEEPS_PER_ITERATION = 500
"""Sweeps of the closed form that max_iterations allows for each of its iterations: it needs O(k²) of them."""
RISE_RADII = 0.5
"""How deep into the wall, in wire radii, one step may push the axis of a tip that goes straight on: a tip that only
touches can thus rise by 1.5 radii, and one step cannot climb over a wall that is thicker than a radius."""
BUDGET_STEPS = 20
"""Relaxations that one depth may spend, at max_iterations each, on top of four for every step of step_mm."""
WORK = 8_000_000
"""Joints and look-up points that all iterations or sweeps of one depth may go through, whatever max_iterations: 80,000
sweeps of 50 joints with one look-up each (the closed form needs up to 75,000 for a step in a bend), or 2,000 of
Newton's iterations at 2000 joints. Thus a hopeless depth ends after two or three seconds."""
WORK_PER_ITERATION = 2_500
"""The same, for each of max_iterations on top: raising max_iterations must help."""
FREE_ITERATIONS = 20
"""Iterations of a longest step that came to rest, of shorter ones their share, that do not count: they take 4 to 12. A
depth of 250 mm with friction, asked for alone, ended at 176 mm, though all of 5, 10, 15 ... mm came to rest."""
LONGEST_WAY = 1e8
"""Joints that the steps to one depth may lay out, all together: a wire that touches nothing takes half a minute, and
400 mm of 0.25 mm segments in steps of 0.01 mm are 6e7."""
LONG_WAY = 2e5
"""The same, from which on a way runs in a thread of its own (0.1 ms) so that Ctrl-C can end it: a tenth of a second."""
LOOK_AHEAD_MM = 2.0
"""How far past its step a tip looks for another vessel behind the wall: further than any step can carry it."""
UNMOVED = 1e-4
"""Change of a joint in a step, over the largest change of any, below which it has not moved: the joints from the base
to the first that moved are left alone for a while."""
WORTHWHILE = 0.25
"""Share of the joints that must be left alone for that to save more than looking at all of them again costs."""
FORETOLD = 100.0
"""A step that lowers the energy by D + T where the model predicts D leaves a decrement of about 2 to 10 T²/D (from the
third and fourth order of the energy): where that is below a tenth of the tolerance, a sweep would only confirm it."""
WORTH_FORESEEING = 0.9
"""A foreseen start is taken where its energy above that predicted from the hand's push is below this share of the slid
start's. Of 0.35, 0.5, 0.7 and 0.9 this takes the fewest sweeps in winding vessels, in steps of 1 and ¼ segment."""
SURELY_FORESEEN = 0.1
"""The same share of what the slid start had when it was last computed, below which it is not computed again."""
STILL_RISES = 0.7
"""Factor on that last value after each step that did not compute it: about one step of six then computes it."""
MOST_FORESEEN = 1.5
"""Most of the last step's change that a longer one starts with: further ahead it is a guess. With none a wire that is
laid on straight through the wall hopped over barriers that step_mm = 0.05 does not pass."""
OVERSHOOT = 0.02
"""How much longer than allowed a step may be rather than leave a remainder: the limits are round numbers."""
CREASE_BLOCK = 4
"""Voxels along an edge of the blocks in which creases of the distance are marked."""
CREASE = 0.3
"""Fall of the distance's slope from one voxel to the next that counts as a crease: at a ridge between parallel walls it
falls by 2, of which at least 0.58 is seen along an axis at one voxel; round an obstacle of r voxels it falls by 1/r."""
CREASE_REACH_MM = 0.8
"""Longest way over which the slope may fall by that: a Gaussian of 0.4 mm spreads the fall over it; the next vessel's
own axis, where the slope rises again, is not much further from the ridge of a thin septum."""
CREASE_SLOPE = 0.7
"""Slope, by differences over the same way, beyond which there is no crease: on the ridge it is 0 between parallel
vessels and the sine of half their angle in a fork; round the inner wall of a bend it is 1."""
FOOT_STEPS = 64
"""Steps of half a voxel down the distance until a place in the wall is given up as belonging to no lumen."""
FOOT_MM = 1e-9
"""Difference from the distance at which feet end, mm, that is rounding: without it every third place was given up."""
RIDGE_BEND = 0.5
"""Fall of the distance's slope over a voxel from which on a place with little slope is on a ridge: there it falls by up
to 2, at a carina's edge by less than it rises in the other direction, and round a vessel's own axis it rises."""
RIDGE_SLOPE = 0.1
"""Slope across a ridge below which a place lies on it: a twentieth of a voxel aside it has that much."""
RIDGE_VOXELS = 0.05
"""Rise of the distance above both ends of a way, in voxels, that is a ridge: the chord of a foot's move along a wall
that curves with two voxels of radius rises by a fifteenth of that."""
OPEN_VOXELS = 0.35
"""Distance, in voxels, by which a place must be inside the lumen for it to be open, be it narrower than the wire: where
vessels touch, what the grid holds of the wall between them lies up to a quarter inside."""
DETOUR_MM = 1.5
"""How far off the straight way between two feet lumen may still join them: a wire may cut off so much of a carina."""
BURIED_RADII = 4.0
"""Way from lumen to lumen, over the wire's radius or half a voxel, from which on its whole cross-section is in the wall
on its way over an edge: the feet of the way are a radius deep in the lumens."""
SUNK_RADII = 8.0
"""The same, from which on no edge is so blunt that the wire only presses on it: a wall of about six radii."""
BURIED_DETOUR = 1.75
"""How much longer than the straight way between its two feet the way around may be for a wire so deep: as it is round
an edge of 70 degrees, those of necks and rings being blunter."""
FLOOD_CELLS = 48
"""Most cells along the way of a flood fill, however fine the grid is."""
REFINE = 0.2
"""Length of the steps tried after a rough one, over its length: 1, 0.2 and 0.05 mm; with friction 0.1 and 0.05."""
EASY = 6
"""Iterations that a step along the same minimum does not reach: it takes two to five."""
SWIFT = 3
"""Iterations up to which a gain of energy raises no doubt about a step: the trapezium rule is wrong where a jump of
rest curvature passes the entry. Of 16 hops that showed by a gain alone, 12 took more iterations."""
TOIL = 20
"""Most iterations that a step without a hop usually takes: 12 of 139 hops at sharp edges showed by them alone, and a
soft wire may lose no energy in a hop. A stiff wire must also miss some work: it may merely buckle in a sheath."""
SIGHT_SHARE = 0.5
"""Least share of TOIL for a step that is short only for what the tip sees: one of 0.25 mm hopped in 14 iterations."""
WORK_SHARE = 0.01
"""Share of the hand's work in a hard step that may be missing from the wire's energy: the trapezium rule over 1 mm is
right to that in most smooth steps, and where the wire found another minimum 0.016 and more were missing."""
ENERGY_SHARE = 5e-4
"""The same of the wire's energy, where the hand does hardly any work."""
LOSS_SHARE = 0.05
"""The same of what friction takes: its loads are known at the ends of a step only."""
CHANGE_SHARE = 0.08
"""The same of the change of the hand's force times its way, in a step of step_mm: the trapezium rule is off by 0.5 of
that where a contact closes at once. This passes 1,600 of 2,000 hard steps that short ones confirmed, and no hop."""
GIVES = 0.1
"""Share of that change that a hard step may miss or gain where it ends with a smaller push: in 8,000 scenes 13 of 64
hops that went unseen had more, and 950 steps without a hop."""
FURTHER = 1.05
"""Way of a joint, over the hand's, above which a stiff wire did more than follow its base: all of these hops did."""
STRAYS = 0.5
"""Share of what may be missing that is too much beyond a catheter's tip wherever a joint moved further than the hand or
the relaxation met an unstable state: of 13 silent hops with a catheter 14 mm behind the tip 12 had more, and 8 % of the
steps without one; all that may be missing there tells 6."""
FORKS = 0.2
"""The same of a whole wire whose relaxation met an unstable state: of 72 hops in vessels with sacs that nothing else
told 31 had more. Of the others 5 gained all that may be missing, in more than SWIFT iterations."""
FAR_ABOVE = 2.0
"""Energy of a step's start, over that at its end, above which neither tells of a hop: one of 37 hops began there, and
142 of the 253 steps without one, of 10,270 in random vessels, that show one or the other."""
STRANGE = 2.0
"""No step, however easy, may miss or gain more than this many times what may be missing, plus all of that change: 92 of
139 hops at sharp edges did, many in two or three iterations, and 43 of 4,400 steps elsewhere."""
GAINED = 2.0
"""What a stiff wire may gain, as a multiple of what it may lose: half of the hops at sharp edges, where the tip is
lifted over a step that would have stopped it, gained more."""
SOFT_SHARE = 0.2
"""Share of what a stiff wire may miss that is too much, of either sign, for a soft one, and for a stiff one that took
more than TOIL."""
FREE_SHARE = 0.03
"""The same for a wire that is free to turn, or nearly so: it hops by losing next to nothing."""
CRITICAL = 0.001
"""Pivot below which the wire is about to give way, in a direction that rounding decides."""
FREE = 0.05
"""Pivot below which a wire is free to turn about the axis of a round vessel, or nearly so."""
LOOSE = 0.006
"""Pivot below which long and short steps may agree by chance: in a sphere the grid alone holds a straight wire."""
SAME_MM = 1e-3
"""Distance of the joints below which long and short steps led to the same wire: a tenth of what counts as elsewhere,
ten times what soft wires differ by."""
SOFT = 0.5
"""Pivot below which a wire is soft: moments that are nothing elsewhere move it far, and it hops by losing little."""
SOFT_TOLERANCE = 1e-4
"""Tolerance of a soft wire, over the one asked for: at 1e-9 of the energy such wires lay up to 0.04 mm off."""
STIFF = 0.2
"""Pivot above which a wire that was about to give way becomes certain again: in a round vessel it stays free to turn
about the axis, and lies on the side that rounding chose."""
SNAP_WAYS = 2.0
"""A joint that moves in a step by less than this many times the hand's way is merely pushed, and does not snap."""
SAME_WAY = 0.9
"""Cosine of the angle between two moves of the hand (along, around the wire) above which friction hardly changes."""
ELSEWHERE_MM = 0.1
"""A doubtful step in which no joint moved by more has not led the wire elsewhere: twice the finest step."""
SOFTEST = 1e-9
"""Size of the smallest negative Levenberg term that is tried for a wire's softest mode; one in a sphere gives way at
3e-8."""
RUNGS = 72
"""Terms that are tried, each 10^(1/4) times the one before: up to WORST_DAMPING."""
SLIGHT = 1e-4
"""Turn, rad, from which that mode's displacements are computed: its square is negligible."""
APART_MM = 0.01
"""Largest distance between the joints of two wires above which they lie on two sides: what counts as elsewhere."""
AS_LOW = 1e-3
"""Relative difference of two energies that does not tell which of two sides a wire takes: its stiffness is known to 1 %
at best. In 6,000 insertions the sides that long and short steps took differed by up to 4e-4."""
UNDECIDED_MM = 5.0
"""Way, mm, on which a wire that took one of two sides is called uncertain. With 2.5 mm, 4 more of 218,400 depths are
off without the flag; for as long as both sides lie apart, the flag would cover 5.15 % of them instead of 4.86 %."""
DOUBT_LASTS_MM = 2.5
"""Way, mm, after a snap on which a wire may still lie elsewhere than after shorter steps."""
HELD_SHARE = 0.25
"""What a mm of that way counts where friction holds the wire on the side to which it went: two were 5 to 7 mm apart,
one of them gone by 2.5 mm later, the other still there."""
