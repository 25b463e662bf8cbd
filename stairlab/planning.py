"""What a motion set could do at best: search in the deterministic world for the best return of an episode of Up The Stairs.

It separates "the set cannot climb" from "the agent did not learn to".
"""

from __future__ import annotations

import copy
import heapq
import itertools
import math
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from tqdm import tqdm

from stairlab._validation import finite_array, finite_number, whole_number
from stairlab.physics import CUBE_EDGE, Staircase
from stairlab.prototypes import Prototypes
from stairlab.world import CubeWorld, Jump, StairWorld, yaw_of

MAX_JUMPS = 50
""" Jumps in an episode """
DEAD_BAND = 0.05
""" Changes of height below it are jitter: no reward, no punishment [m] """
MAX_SIMULATED = 20_000
""" Jumps that a search may simulate """
TOLERANCE = 0.001
""" Rest states on the same step, in the same cell of this width in y, are taken for one [m] """
ROTATION_CELL = 5.0
""" ... if they are also turned alike, in cells of this width; a quarter turn leaves a cube as it was [deg] """
GAPS = tuple(np.geomspace(0.001, 0.3, 40).round(5).tolist())
""" Gaps to the riser ahead from which ``trap_width`` tries the motions [m] """
LOWEST_RISE = 0.1
""" Steps lower than this are refused: the dead band would hide them, or take a leaning cube for a climbing one [m] """


def jump_reward(dz: float, rise: float) -> float:
    r"""Return the reward of a jump (equation 5 as its text means it, with the dead band of the published code).

    .. math:: r = \begin{cases} 1 & \text{if } \Delta z > 0.05 \\ \Delta z / h & \text{if } \Delta z < -0.05 \\
              0 & \text{else} \end{cases}

    Parameters
    ----------
    dz : float
        Height gained [m].
    rise : float
        Height of a step h [m].

    Returns
    -------
    float
    """
    if dz > DEAD_BAND:
        return 1.0
    return dz / rise if dz < -DEAD_BAND else 0.0


def on_top(staircase: Staircase, jump: Jump) -> bool:
    """Whether the cube rests on the last tread after a jump."""
    return bool(jump.end[2] > staircase.top + CUBE_EDGE / 2 - DEAD_BAND)


def ends_episode(staircase: Staircase, jump: Jump) -> bool:
    """Whether a jump ends the episode: it leaves the map, or the cube rests on the last tread."""
    return not jump.on_map or on_top(staircase, jump)


@dataclass(frozen=True, eq=False)
class Plan:
    """The best episode that a search found for a motion set, and what the search covered.

    Attributes
    ----------
    value : float
        Return of the episode: a lower bound on what the set allows, because its jumps were simulated one after the other.
    bound : int
        No episode with these motions returns more, counted in whole steps, up to the merging of like states. In a random world both
        hold for its fixed draw, such as the fixed rocking: for a robot that knows how the cube rocks.
    motions : ndarray of shape (n_jumps,), int
        The jumps of the episode, as row numbers of the set.
    states : ndarray of shape (n_jumps + 1, 8)
        The start and the state after each jump (features as in ``stairlab.world.FEATURES``).
    rewards : ndarray of shape (n_jumps,)
        Reward of each jump.
    steps_climbed : int
        The highest step that the cube rests on.
    reached_top : bool
        Whether that is the last one.
    exhausted : bool
        Whether the search came to its end: no state is left that could lead to a better return. If not, it was cut by its budget.
    expanded : int
        States from which every motion was tried.
    merged : int
        Arrivals at a state like one that was known before and no worse; they were not followed.
    simulated : int
        Jumps simulated.
    settings : dict
        ``max_jumps``, ``max_simulated`` and ``tolerance``.
    """

    value: float
    bound: int
    motions: np.ndarray = field(repr=False)
    states: np.ndarray = field(repr=False)
    rewards: np.ndarray = field(repr=False)
    steps_climbed: int
    reached_top: bool
    exhausted: bool
    expanded: int
    merged: int
    simulated: int
    settings: dict[str, float] = field(repr=False)

    @property
    def whole_value(self) -> int:
        """The return in whole steps: what ``value`` would be if a cube never leaned when it rests."""
        return int(np.rint(self.rewards).sum())

    @property
    def proved(self) -> bool:
        """Whether the return meets the bound, in whole steps: no better episode exists, up to the merging of like states."""
        return self.whole_value >= self.bound

    def __len__(self) -> int:
        return len(self.motions)


def best_return(
    staircase: Staircase | CubeWorld,
    motions: Prototypes | np.ndarray,
    *,
    max_jumps: int = MAX_JUMPS,
    max_simulated: int = MAX_SIMULATED,
    tolerance: float = TOLERANCE,
    progress: bool = True,
) -> Plan:
    r"""Search for the best return that a motion set allows in one episode, from the start pose.

    The episode is that of Up The Stairs: rewards by ``jump_reward``; it ends off the map, on the last tread, or after
    ``max_jumps``. Counted in whole steps, a jump that gains m steps earns 1 and so loses m - 1 of what could be earned; a fall of f
    steps costs f, which single steps earn back. After j jumps, on step k of n with return R, an episode can thus at best return

    .. math:: R + \min(n - k, \; j_{max} - j),

    and this bound never rises on the way. The search keeps all states that it found and tries every motion from the most promising
    one, taken in turn by this bound (which proves) and by return minus steps lost (which soon finds a good climb); states whose
    bound is not above the best return are dropped. Equal bounds: the highest step first, then the fewest jumps.

    Resting places differ by micrometres, so states are merged if they are on the same step, in the same cell of ``tolerance`` in y
    and of 5 degrees in rotation (modulo 90), and the earlier one lost no more steps and took no more jumps. What that costs: the
    dropped state could have led elsewhere, so that a better return may be missed, and ``bound`` holds up to this merging. The
    episode itself is never a composition of merged states. It is one sequence of jumps, simulated from the start.

    An episode goes on until it ends: where the best return is found short of the top, the remaining jumps are filled in greedily
    (best reward first, then the shortest way), each simulated too. If that costs steps, a second search within the same budget counts
    whole episodes only, and merges states only after equally many jumps.

    Parameters
    ----------
    staircase : Staircase or CubeWorld
        The stairs, which are then those of the plane; ``Staircase.fifteen()`` for the learning task. Or a world, such as
        ``TumblingWorld(Staircase.fifteen())``. A jump of the search is given no generator: in the tumbling world the cube rocks
        before each jump in the same, fixed way, so the search says what a robot could do that knows how the cube rocks.
    motions : Prototypes or array-like of shape (n_motions, 2)
        Magnitude [N] and angle [deg], all different. They are rounded to single precision, as the environment's actions are, so that
        the plan does there what it does here.
    max_jumps : int
        Jumps in an episode.
    max_simulated : int
        Budget: no further state is tried after this many simulated jumps. Filling in comes on top, with at most
        ``max_jumps * n_motions``.
    tolerance : float
        Width of a cell in y [m].
    progress : bool
        Show a progress bar.

    Returns
    -------
    Plan

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described, or a step is lower than 0.1 m.

    Notes
    -----
    A cube can come to rest leaning on a riser, up to 2 cm higher than upright. The reward for a fall is proportional, so a fall
    that ends so costs up to 0.07 steps less than whole steps would, and one that begins so that much more. ``value`` and ``rewards``
    are exact and hold that; the search and its bound count in whole steps. A return may therefore exceed the number of steps by
    some hundredths for each fall. A jump that is not over within the world's time limit is no way on.

    Examples
    --------
    >>> plan = best_return(Staircase(2), [[300, 75], [500, 70]], progress=False)
    >>> plan.steps_climbed <= 2, plan.value <= plan.bound
    (True, True)
    """
    if not isinstance(staircase, Staircase | CubeWorld):
        raise TypeError(f"staircase must be a Staircase or a world of the stairs, not {staircase!r}.")
    world = _world_of(staircase)
    finite_number("staircase.rise", world.staircase.rise, low=LOWEST_RISE)
    values = _checked(world, motions)
    settings: dict[str, float] = {
        "max_jumps": whole_number("max_jumps", max_jumps, low=1),
        "max_simulated": whole_number("max_simulated", max_simulated, low=1),
        "tolerance": finite_number("tolerance", tolerance, above=0),
    }
    with tqdm(total=max_simulated, desc="planning", unit="jump", disable=not progress, leave=False, delay=0.5) as bar:
        first = _Search(world, values, max_jumps, tolerance)
        first.run(max_simulated, bar)
        searches, episode = [first], first.played_on(first.best)
        if episode.score < first.best.score:
            second = _Search(world, values, max_jumps, tolerance, episode)
            second.run(max_simulated - first.simulated, bar)
            searches, episode = [first, second], second.best
    return _plan(searches, episode, settings)


def trap_width(staircase: Staircase | CubeWorld, motions: Prototypes | np.ndarray) -> float:
    r"""Return the gap to the riser ahead below which no motion of a set climbs: the width of the trap that the riser is.

    A riser takes the forward part of a push, so a cube climbs from a gap g only on a path that is steep enough to pass the edge,

    .. math:: \tan \alpha > h / g,

    with h the height of a step (a cube that tumbles over the edge needs a little less). Every motion at least half as steep is tried,
    from upright on the tread in the middle of the stairs.

    Parameters
    ----------
    staircase : Staircase or CubeWorld
        The stairs (of the plane), or a world.
    motions : Prototypes or array-like of shape (n_motions, 2)
        Magnitude [N] and angle [deg], all different.

    Returns
    -------
    float
        The largest gap of ``GAPS`` for which neither it nor any smaller one lets a motion climb [m]; 0 if there is none, infinite
        if no motion climbs from any.

    Raises
    ------
    ValueError, TypeError
        If an argument is not as described.

    Examples
    --------
    >>> trap_width(Staircase.fifteen(), [[500, 80]]) > trap_width(Staircase.fifteen(), [[500, 80], [500, 88]])
    True
    """
    world = _world_of(staircase)
    staircase = world.staircase
    values = _checked(world, motions)
    slope = np.tan(np.radians(values[:, 1]))
    widest = 0.0
    for gap in GAPS:
        if any(_climbs(world, gap, motion) for motion in values[slope > staircase.rise / gap / 2]):
            return widest
        widest = gap
    return math.inf


def _world_of(staircase: Staircase | CubeWorld) -> CubeWorld:
    """Return a world of its own for a search: the plane's, if stairs are given."""
    if isinstance(staircase, CubeWorld):
        world = copy.copy(staircase)
        world.reset()
        return world
    return StairWorld(staircase)


def jumps_to_climb(world: CubeWorld, motions: np.ndarray, max_simulated: int = 1000) -> float:
    """Search for the fewest jumps of a set after which the cube can rest higher than it does now.

    Breadth first over the rest states that the set can reach, where states within 0.1 mm (and upright alike) are taken for one.

    Parameters
    ----------
    world : StairWorld or TumblingWorld
        The cube in its present state; it stays as it is.
    motions : array-like of shape (n_motions, 2)
        Magnitude [N] and angle [deg].
    max_simulated : int
        Budget: no further state is tried after this many simulated jumps.

    Returns
    -------
    float
        Number of jumps; infinite if no sequence of jumps leads higher, NaN if the budget ran out before that was known.
    """
    values = _checked(world, motions)
    goal = world.state[2] + DEAD_BAND
    layer, known, jumps, simulated = [world], {_resting_place(world)}, 0, 0
    while layer:
        jumps += 1
        following = []
        for place in layer:
            if simulated >= max_simulated:
                return math.nan
            for _, jump, there in _tried(place, values):
                simulated += 1
                if jump.on_map and jump.end[2] > goal:
                    return jumps
                if not ends_episode(world.staircase, jump) and _resting_place(there) not in known:
                    known.add(_resting_place(there))
                    following.append(there)
        layer = following
    return math.inf


def _tried(world: CubeWorld, motions: np.ndarray) -> Iterator[tuple[int, Jump, CubeWorld]]:
    """Try each motion from a world's state: its row, the jump, and the world after it; one that is not over in time is left out."""
    for row, motion in enumerate(motions):
        there = copy.copy(world)  # a jump replaces the state of the copy
        try:
            jump = there.perform(motion)
        except RuntimeError:
            continue
        yield row, jump, there


def _resting_place(world: CubeWorld) -> tuple[float, ...]:
    _, y, z, *quaternion, _ = world.state.tolist()
    return round(y, 4), round(z, 3), *(round(q, 2) for q in quaternion)


def _climbs(world: CubeWorld, gap: float, motion: np.ndarray) -> bool:
    """Whether a motion gains height from upright at a gap to the middle riser."""
    stairs = world.staircase
    below = stairs.n_steps // 2
    world.reset(world.state_at(stairs.risers[below] - gap - CUBE_EDGE / 2, stairs.rise * below + CUBE_EDGE / 2))
    try:
        return bool(world.perform(motion).dz > DEAD_BAND)
    except RuntimeError:  # not over within the time limit
        return False


def _checked(world: CubeWorld, motions: Prototypes | np.ndarray) -> np.ndarray:
    given = finite_array("motions", motions.motions if isinstance(motions, Prototypes) else motions, columns=2)
    values = given.astype(np.float32).astype(float)
    outside = ((values < world.motion_low) | (values > world.motion_high)).any(axis=1)
    if outside.any():
        row = int(outside.argmax())
        raise ValueError(
            f"motions must lie between {world.motion_low} and {world.motion_high}, but row {row} is {given[row]}."
        )
    if len(np.unique(values, axis=0)) < len(values):
        raise ValueError("motions must all be different, but some rows are there more than once; leave them out.")
    return values


@dataclass(frozen=True, eq=False)
class _Node:
    """An episode so far: the world with the cube where it rests, and how it came there."""

    world: CubeWorld
    step: int
    score: int  # return in whole steps
    jumps: int = 0
    ended: bool = False
    motion: int = -1
    reward: float = 0.0
    parent: _Node | None = None

    @property
    def lost(self) -> int:
        """Steps that were climbed without being paid for."""
        return self.step - self.score

    def way(self) -> list[_Node]:
        """Return the nodes from the start to here."""
        nodes = [self]
        while (parent := nodes[-1].parent) is not None:
            nodes.append(parent)
        return nodes[::-1]


class _Search:
    """Best-first search over rest states, by two orders in turn.

    Without an ``episode`` to beat, it looks for the best return at any moment. With one, it counts whole episodes only, and takes
    states for alike only after equally many jumps: where going on costs, more jumps may be better than fewer.
    """

    def __init__(
        self, world: CubeWorld, motions: np.ndarray, max_jumps: int, tolerance: float, episode: _Node | None = None
    ) -> None:
        self.motions, self.max_jumps, self.tolerance = motions, max_jumps, tolerance
        self.staircase = world.staircase
        start = _Node(world, step=0, score=0)
        self.best = episode or start
        self.whole = episode is not None
        self.by_bound: list[tuple] = []
        self.by_climb: list[tuple] = []
        self.serial = itertools.count()
        self.tried: set[_Node] = set()
        self.known: dict[tuple[int, int, int, int], list[tuple[int, int]]] = {}
        self.simulated = self.merged = 0
        self.push(start)

    def bound(self, node: _Node) -> int:
        """The most that an episode can return, in whole steps, that begins like this one."""
        if node.ended:
            return node.score
        return node.score + min(self.staircase.n_steps - node.step, self.max_jumps - node.jumps)

    def push(self, node: _Node) -> None:
        number = next(self.serial)  # of equals the first found comes first
        heapq.heappush(self.by_bound, (-self.bound(node), -node.step, node.jumps, number, node))
        heapq.heappush(self.by_climb, (node.lost - node.score, -node.step, node.jumps, number, node))

    def head(self, queue: list[tuple]) -> _Node | None:
        """Return the first of a queue that is yet to be tried and could still lead to a better return."""
        while queue and (queue[0][-1] in self.tried or self.bound(queue[0][-1]) <= self.best.score):
            heapq.heappop(queue)
        return queue[0][-1] if queue else None

    @property
    def exhausted(self) -> bool:
        """Whether no state is left that could lead to a better return."""
        return self.head(self.by_bound) is None

    @property
    def open_bound(self) -> int:
        """The most that what is found, or still open, can return."""
        left = self.head(self.by_bound)
        return self.best.score if left is None else self.bound(left)

    def run(self, budget: int, bar: tqdm) -> None:
        """Try states until none is left that could lead to a better return, or the budget is spent."""
        for queue in itertools.cycle((self.by_bound, self.by_climb)):
            node = self.head(queue)
            if node is None or self.simulated >= budget:
                return
            self.tried.add(node)
            for child in self.children(node):
                self.consider(child)
            bar.update(len(self.motions))
            bar.set_postfix(best=self.best.score, refresh=False)

    def consider(self, node: _Node) -> None:
        """Keep a new node if it could lead to a better return and is not like, and no better than, a known one."""
        if node.score > self.best.score and (not self.whole or node.ended or node.jumps == self.max_jumps):
            self.best = node
        if self.bound(node) <= self.best.score:
            return
        alike = self.known.setdefault(self.cell(node), [])
        if any(lost <= node.lost and self.as_early(jumps, node.jumps) for lost, jumps in alike):
            self.merged += 1
            return
        alike.append((node.lost, node.jumps))
        self.push(node)

    def as_early(self, jumps: int, others: int) -> bool:
        return jumps == others if self.whole else jumps <= others

    def cell(self, node: _Node) -> tuple[int, int, int, int]:
        """Return the cell of like states: step, y, and rotation about x and about the vertical, each modulo 90 degrees."""
        _, y, _, qx, qy, qz, qw, _ = node.world.state.tolist()
        quarter = round(90 / ROTATION_CELL)
        turned = round(math.degrees(2 * math.atan2(qx, qw)) / ROTATION_CELL) % quarter
        return node.step, round(y / self.tolerance), turned, round(yaw_of(qx, qy, qz, qw) / ROTATION_CELL) % quarter

    def children(self, node: _Node) -> list[_Node]:
        """Try every motion; a jump that is not over in time leads nowhere."""
        self.simulated += len(self.motions)
        return [self.child(node, *tried) for tried in _tried(node.world, self.motions)]

    def child(self, node: _Node, motion: int, jump: Jump, world: CubeWorld) -> _Node:
        """Return the episode that goes on with a jump."""
        step = round((float(jump.end[2]) - CUBE_EDGE / 2) / self.staircase.rise)
        return _Node(
            world,
            step,
            node.score + min(step - node.step, 1),
            node.jumps + 1,
            ends_episode(self.staircase, jump),
            motion,
            jump_reward(jump.dz, self.staircase.rise),
            node,
        )

    def played_on(self, node: _Node) -> _Node:
        """Fill in the rest of an episode greedily: best reward first, then the shortest way."""
        while not node.ended and node.jumps < self.max_jumps and (children := self.children(node)):
            y = node.world.state[1]
            node = max(children, key=lambda child: (child.score, -abs(child.world.state[1] - y)))
        return node


def _plan(searches: list[_Search], episode: _Node, settings: dict[str, float]) -> Plan:
    nodes = episode.way()
    rewards = np.array([node.reward for node in nodes[1:]])
    climbed = max(node.step for node in nodes)
    return Plan(
        value=float(rewards.sum()),
        bound=min(search.open_bound for search in searches),
        motions=np.array([node.motion for node in nodes[1:]], dtype=int),
        states=np.array([node.world.state for node in nodes]),
        rewards=rewards,
        steps_climbed=climbed,
        reached_top=climbed == episode.world.staircase.n_steps,
        exhausted=searches[-1].exhausted,
        expanded=sum(len(search.tried) for search in searches),
        merged=sum(search.merged for search in searches),
        simulated=sum(search.simulated for search in searches),
        settings=settings,
    )
