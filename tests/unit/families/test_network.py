"""A learned network: its groups, its gains, its file. The one used here was learned by `make_network.py` beside it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numba import njit

import turing_learning as tl
from turing_learning.cli import main
from turing_learning.families import Couzin, Network, _imitation, _tank, virtual_group
from turing_learning.families._losses import NO_LOSSES, Losses
from turing_learning.kernels import imitation
from turing_learning.trajectories import Trajectories

pytest.importorskip("safetensors")
pytestmark = pytest.mark.usefixtures("few_kernels", "few_moves")
FILE = Path(__file__).parent / "couzin.safetensors"


@pytest.fixture(scope="module")
def network():
    return Network.load(FILE)


def values(network, count, **gains):
    return np.tile([gains.get(name, 1.0) for name in network.parameters], (count, 1))


def nearest(positions):
    """Median distance (cm) of the nearest other."""
    distance = np.linalg.norm(positions[:, :, :, None] - positions[:, :, None], axis=-1)
    distance[..., np.arange(distance.shape[-1]), np.arange(distance.shape[-1])] = np.inf
    return np.median(distance.min(axis=-1))


def test_a_sample_has_the_steps_and_signals_of_the_family(network):
    samples = network(values(network, 6), np.random.default_rng(1))
    assert samples.shape == (6, 1, network.steps, len(network.signals))
    assert np.isfinite(samples).all()


def test_the_motion_of_a_model_does_not_depend_on_the_others(network):
    alone = network.simulate(values(network, 1), np.random.default_rng(2))
    among = network.simulate(values(network, 5), np.random.default_rng(2))
    assert (alone[0] == among[0]).all()


def in_a_tank(network):
    """The same network as if its tank, a square of 40 cm around the origin, had walls."""
    grid = _tank.rectangle_grid(np.zeros(2), (40.0, 40.0))
    moved = network.brain.starts.paths
    starts = network.brain.starts._replace(
        paths=moved - moved[:, -1:].mean(axis=(1, 2), keepdims=True)
    )
    brain = network.brain._replace(tanks=_tank.tanks_of([grid], [True]), starts=starts)
    return replace(network, brain=brain)


def test_nobody_leaves_a_tank(network):
    inside = in_a_tank(network)
    positions = inside.simulate(values(inside, 4), np.random.default_rng(3))
    assert np.abs(positions).max() <= 20.0


def test_a_piece_is_turned_along_a_wall_by_no_more_than_it_has_to():
    sides = (40.0, 40.0)
    tanks = _tank.tanks_of([_tank.rectangle_grid(np.zeros(2), sides)], [True])
    ahead = np.array([(2.0, 0.0), (4.0, 0.0), (8.0, 0.0)])

    @njit(error_model="numpy")
    def bend(tanks, y, angle, pieces, leaving):
        moments = pieces.ahead.shape[1]
        return imitation.bend_inside(tanks, 0, 0.0, y, angle, 1.0, pieces, 0, moments, leaving)

    def turned(y, angle, leaving=False, turn=0.1):
        # one piece, of which nobody asks more than where it leads and how it turns
        nothing = [np.zeros(1)] * len(imitation.Pieces._fields)
        pieces = imitation.Pieces(*nothing)._replace(ahead=ahead[None], turn=np.array([turn]))
        return bend(tanks, y, angle, pieces, leaving)

    # 5 cm from the wall a way of 8 cm fits if it rises by at most asin(5 / 8), 0.675
    assert turned(15.0, 0.5) == 0.0
    assert 0.0 < 0.8 + turned(15.0, 0.8) < 0.675
    assert -turned(15.0, 0.8) < 0.8 - 0.675 + imitation.BEND
    assert turned(-15.0, -0.8) == -turned(15.0, 0.8)
    # straight ahead both sides fit: the piece turns on as it does, also in a mirror
    assert turned(13.0, np.pi / 2, turn=-0.1) == -turned(13.0, np.pi / 2, turn=0.1) < 0
    # straight at the wall it does not fit, and who goes somewhere is not turned
    assert np.isnan(turned(19.0, np.pi / 2))
    assert np.isnan(turned(15.0, 0.8, leaving=True))


def test_a_course_is_that_of_the_last_step_and_of_one_at_rest_that_before():
    nowhere = np.full(2, np.nan)
    turned = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])[:, None]
    rested = np.array([[0.0, 0.0], [0.0, 1.0], [0.0, 1.0]])[:, None]

    @njit(error_model="numpy")
    def course(path):
        return imitation.course(path, 2, 0, nowhere)

    for path in (turned, rested):
        assert course(path) == np.pi / 2


def test_individuals_come_as_near_to_each_other_as_they_were_recorded_to(network):
    longer = replace(network, steps=300)
    positions = longer.simulate(values(longer, 12), np.random.default_rng(3))
    distance = np.linalg.norm(positions[:, :, :, None] - positions[:, :, None], axis=-1)
    distance[..., np.arange(distance.shape[-1]), np.arange(distance.shape[-1])] = np.inf
    # In 0.5 % of the recorded time and 0.01 % of that of these models (decision 0075). It was 0.12 %
    # where nobody knew what others had chosen, 3.6 % where nobody looked ahead
    assert (distance.min(axis=-1) < network.brain.units.closest).mean() < 0.0006


def test_who_follows_is_clear_and_who_meets_is_not():
    # three in a row, 10 cm apart: the first two go on to the right, the last comes towards them
    path = np.zeros((2, 3, 2))
    path[:, :, 0] = (0.0, 10.0, 20.0)
    steps = np.array([1.0, 2.0, 4.0, 8.0])
    velocities = np.array([1.0, 1.0, -1.0])
    futures = np.zeros((3, 4, 2))
    futures[..., 0] = path[1, :, 0, None] + velocities[:, None] * steps

    @njit(error_model="numpy")
    def clearance(path, i, futures, closest):
        return imitation.clearance(path, 1, i, futures, closest)

    # whoever walks behind another comes no nearer
    assert clearance(path[:, :2], 0, futures[:2], 12.0) == 1.0
    # 10 cm apart, both meet by 1 cm in a step: 2 cm are left after the moment in 4 steps, 6 after that in 8
    assert clearance(path, 1, futures, 4.0) == pytest.approx((2.0 / 4.0) ** 2)
    # the way of another is looked at first: with other choices they pass
    futures[2, :, 1] = (1.0, 2.0, 4.0, 8.0)
    assert clearance(path, 1, futures, 4.0) == 1.0


def test_mistakes_of_a_tracker_are_no_part_of_a_ring():
    rng = np.random.default_rng(1)
    angles = rng.uniform(0, 2 * np.pi, 20_000)
    radii = np.sqrt(rng.uniform(19.0**2, 30.0**2, 20_000))
    places = np.stack([radii * np.cos(angles), radii * np.sin(angles)], axis=1)
    places[:50] *= rng.uniform(0, 10, (50, 1)) / radii[:50, None]
    corner, inside, cell = _tank.recorded_grid(places)
    distances = np.linalg.norm(corner + (np.argwhere(inside) + 0.5) * cell, axis=1)
    assert 18.0 < distances.min() < 19.5
    assert 29.5 < distances.max() < 31.0
    # as many cells as the ring has, with those that its walls cut
    area = inside.sum() * cell**2
    assert area == pytest.approx(np.pi * (30.0**2 - 19.0**2), rel=0.1)


def test_a_group_and_a_tank_that_were_never_recorded(network):
    other = in_a_tank(network).in_group(12, (30.0, 20.0))
    positions = other.simulate(values(other, 4), np.random.default_rng(3))
    assert positions.shape[2] == 12
    assert ((positions >= 0) & (positions <= (30.0, 20.0))).all()


def test_a_tank_for_a_network_that_never_saw_walls_is_refused(network):
    with pytest.raises(
        ValueError, match="`tank_cm` must be None, as the network was learned without walls"
    ):
        network.in_group(5, (30.0, 20.0))


def test_speed_multiplies_all_lengths(network):
    def median_speed(gain):
        samples = network(values(network, 60, speed=gain), np.random.default_rng(4))
        return np.median(samples[..., network.signals.index("speed")])

    assert median_speed(1.4) / median_speed(0.7) == pytest.approx(2.0, rel=0.1)


def test_attraction_brings_individuals_together(network):
    longer = replace(network, settling_steps=500)

    def distance(gain):
        return nearest(
            longer.simulate(values(longer, 20, attraction=gain), np.random.default_rng(5))
        )

    assert distance(0.0) > 1.2 * distance(1.0)


def test_noise_spreads_the_next_step(network):
    starts = network.brain.starts
    one_moment = starts._replace(
        paths=starts.paths[:1], memories=starts.memories[:1], tank=starts.tank[:1]
    )
    brain = network.brain._replace(starts=one_moment)
    from_one_moment = replace(network, brain=brain, settling_steps=0)

    def spread(gain):
        positions = from_one_moment.simulate(
            values(network, 200, turn_noise=gain), np.random.default_rng(6)
        )
        order = np.argsort(positions[:, 0, :, 0], axis=1)[..., None]
        next_places = np.take_along_axis(positions[:, 1], order, axis=1)
        return next_places.std(axis=0).mean()

    assert spread(0.5) < spread(1.0) < spread(1.5)


def test_a_stored_network_moves_to_the_same_bits(network, tmp_path):
    network.save(tmp_path / "again.safetensors")
    again = Network.load(tmp_path / "again.safetensors")
    first = network.simulate(values(network, 3), np.random.default_rng(7))
    assert (first == again.simulate(values(again, 3), np.random.default_rng(7))).all()


def often_lost(network):
    """The same network where a tracker loses whoever has another within 3 cm, in a twentieth of the steps."""
    losses = Losses(np.array([3.0]), np.array([0.05, 0.0]), np.array([4, 9]), np.array([0.5]))
    return replace(network, brain=network.brain._replace(losses=losses))


def test_samples_are_of_those_whom_a_tracker_does_not_lose(network):
    lossy = often_lost(network)
    samples = lossy(values(network, 40), np.random.default_rng(5))
    assert np.isfinite(samples).all()
    # where a neighbor is lost, another one is the nearest from one step to the next
    jump = np.abs(np.diff(samples[..., network.signals.index("neighbor_distance")])).max()
    whole = network(values(network, 40), np.random.default_rng(5))
    assert jump > 2 * np.abs(np.diff(whole[..., network.signals.index("neighbor_distance")])).max()


def test_virtual_animals_are_never_lost(network):
    everybody = often_lost(network).simulate(values(network, 4), np.random.default_rng(5))
    np.testing.assert_array_equal(
        everybody, network.simulate(values(network, 4), np.random.default_rng(5))
    )


def test_virtual_animals_may_be_seen_as_a_tracker_would_see_them(network):
    lossy = often_lost(network)
    gains = dict.fromkeys(network.parameters, 1.0)
    complete = virtual_group(lossy, gains, duration_s=20, seed=3)
    tracked = virtual_group(lossy, gains, duration_s=20, seed=3, as_tracked=True)
    with pytest.raises(ValueError, match="left out of models that know no tracker"):
        virtual_group(network, gains, duration_s=20, seed=3, as_tracked=True)
    assert complete.present.all()
    assert 0.001 < 1 - tracked.present.mean() < 0.5
    np.testing.assert_array_equal(
        tracked.positions[tracked.present], complete.positions[tracked.present]
    )


def test_a_sample_that_is_too_long_for_a_tracker_is_of_one_who_is_never_lost(network):
    always = NO_LOSSES._replace(chances=np.array([1.0]), gaps=np.array([1]))
    lossy = replace(network, brain=network.brain._replace(losses=always))
    assert np.isfinite(lossy(values(network, 3), np.random.default_rng(5))).all()


def test_a_file_keeps_how_individuals_are_lost(network):
    lossy = often_lost(network)
    again = Network.from_bytes(lossy.to_bytes())
    for kept, own in zip(again.brain.losses, lossy.brain.losses, strict=True):
        np.testing.assert_array_equal(kept, own)
    assert Network.from_bytes(network.to_bytes()).brain.losses is NO_LOSSES


def test_losses_are_those_of_the_recordings_in_which_groups_begin(network):
    others = virtual_group(network, dict.fromkeys(network.parameters, 1.0), duration_s=60, seed=1)
    present = others.present.copy()
    present[100:500:20, 0] = False
    others = replace(others, present=present)
    windows = others.windows(20, signals=("speed", "turn"))
    losses = network.in_recordings(others, windows, tanks=[None]).brain.losses
    assert set(losses.gaps) == {1}


def test_a_file_that_is_no_network_is_refused(tmp_path):
    path = tmp_path / "no.safetensors"
    path.write_bytes(b"nothing of the kind")
    with pytest.raises(ValueError, match="`content` must be a network that `save` wrote"):
        Network.load(path)


def test_another_interval_than_learned_is_refused(network):
    with pytest.raises(
        ValueError, match=r"`interval_s` must be that of what was learned, 0\.1 s; got 0\.2 s"
    ):
        replace(network, interval_s=0.2)


def test_groups_begin_as_others_were_recorded_to(network):
    gains = dict.fromkeys(network.parameters, 1.0) | {"speed": 0.8}
    others = virtual_group(network, gains, duration_s=60, seed=1)
    windows = others.windows(20, signals=("speed", "turn"))
    moved = network.in_recordings(others, windows, tanks=[None])
    assert (moved.steps, moved.signals) == (20, ("speed", "turn"))
    known = {tuple(place) for place in others.positions.reshape(-1, 2)}
    starts = moved.brain.starts
    assert {tuple(place) for place in starts.paths[:, -1].reshape(-1, 2)} <= known
    # what was before is that of a group as fast as those that were learned from
    before = network.brain.starts
    for own, learned in ((starts.memories, before.memories), (starts.paths, before.paths)):
        if own.ndim == 4:
            own, learned = (np.abs(np.diff(paths, axis=1)) for paths in (own, learned))
        assert np.nanmean(own) == pytest.approx(np.nanmean(learned), rel=0.1)


def test_others_in_the_tank_that_was_learned_from_have_the_same_walls(network):
    walled = in_a_tank(network)
    others = virtual_group(walled, dict.fromkeys(walled.parameters, 1.0), duration_s=120, seed=1)
    frames, individuals, _ = others.positions.shape
    # to and fro, soon everywhere
    times = np.arange(frames)[:, None, None] + np.linspace(0, 100, individuals)[:, None]
    to_and_fro = np.abs((times * (0.0137, 0.0211)) % 2 - 1) - 0.5

    def walls_of(sides):
        recording = replace(others, positions=to_and_fro * sides)
        windows = recording.windows(20, signals=("speed", "turn"))
        return walled.in_recordings(recording, windows).brain.tanks

    # nobody has been nearer to a wall than 1 cm
    same = walls_of((38.0, 38.0))
    np.testing.assert_array_equal(same.inside, walled.brain.tanks.inside)
    np.testing.assert_array_equal(same.distance, walled.brain.tanks.distance)
    for sides in ((38.0, 30.0), (44.0, 44.0)):
        tank = walls_of(sides)
        assert tank.inside.sum() * tank.cell**2 == pytest.approx(sides[0] * sides[1], rel=0.1)


def test_walls_that_a_network_has_not_seen_are_refused(network):
    others = virtual_group(network, dict.fromkeys(network.parameters, 1.0), duration_s=20, seed=1)
    windows = others.windows(20, signals=("speed", "turn"))
    with pytest.raises(ValueError, match="`tanks` must be None, as the network was learned wit"):
        network.in_recordings(others, windows)


def test_others_that_come_and_go_are_refused(network):
    others = passing()
    windows = others.windows(20, signals=("speed", "turn"))
    with pytest.raises(ValueError, match="`recordings` must be of individuals that stay"):
        network.in_recordings(others, windows, tanks=[None])


def recorded(individuals, *, steps=400, unit="cm"):
    family = Couzin(individuals=individuals, steps=steps, interval_s=0.1, tank_cm=(30.0, 30.0))
    truth = [8, 4, 1.5, 4, 6, 0.2]
    positions = family.simulate(np.array([truth], dtype=float), np.random.default_rng(1))[0]
    names = tuple(map(str, range(individuals)))
    present = np.ones(positions.shape[:2], dtype=bool)
    return Trajectories(positions, present, fps=10, individuals=names, unit=unit)


def test_one_individual_is_refused():
    recording = recorded(1)
    windows = recording.windows(length_s=2)
    with pytest.raises(ValueError, match="two individuals or more at once"):
        Network.learned(recording, windows)


def test_too_little_is_refused():
    recording = recorded(2, steps=300)
    with pytest.raises(ValueError, match="at least 1000 steps with 4 steps before them and no gap"):
        Network.learned(recording, recording.windows(length_s=2))


def test_nothing_is_learned_from_individuals_that_are_held_out():
    recording = recorded(3)
    windows = recording.windows(length_s=2, hold_out_individuals=["1"])
    (steps,) = windows.frames("learning")
    assert steps.any(axis=0).tolist() == [True, False, True]


def test_nothing_is_learned_from_times_that_are_held_out():
    recording = recorded(3)
    windows = recording.windows(length_s=2)
    (steps,) = windows.frames("learning")
    for begin, end, side in windows.blocks:
        assert (steps[begin:end] == (side == "learning")).all()


def test_a_lasting_average_is_the_own_speed_where_it_was_learned():
    # one goes 1 cm a step and then 3, the other 2 cm and then 4; the later steps are held out
    lengths = np.repeat([[1.0, 2.0], [3.0, 4.0]], 60, axis=0)
    path = np.zeros((121, 2, 2))
    path[1:, :, 0] = np.cumsum(lengths, axis=0)
    learned = path.copy()
    learned[61:] = np.nan
    units = _imitation.units_of([learned], 0.1)
    memories = _imitation.memories_of(path, learned, units)
    lasting = memories[:, :, [2, 5]]
    np.testing.assert_allclose(lasting, np.broadcast_to([[1, 1], [2, 4]], lasting.shape))
    # those of the last second follow what is done, and nothing that a model does moves the lasting ones
    assert memories[-1, 0, 0] == pytest.approx(3, abs=0.02)
    assert units.memory_rates[-1] == 0


def test_a_network_learns_what_it_is_shown():
    pytest.importorskip("torch")
    recording = recorded(4, steps=2000)
    windows = recording.windows(length_s=2)
    told = []
    network = Network.learned(
        recording, windows, steps=600, progress=lambda done, steps: told.append((done, steps))
    )
    assert network.brain.log_likelihood > 0.3  # nats per step better than chance
    assert told[-1] == (600, 600)
    assert not np.isnan(network(values(network, 2), np.random.default_rng(1))).any()


def passing(seconds=240):
    """People who walk along a corridor of 8 m in both directions and are gone then, 10 frames per second."""
    rng = np.random.default_rng(1)
    frames = 10 * seconds
    begins = np.arange(-60, frames, 12)
    positions = np.zeros((frames, len(begins), 2))
    present = np.zeros((frames, len(begins)), dtype=bool)
    for k, begin in enumerate(begins):
        steps = np.cumsum(rng.normal((13, 0), 2, size=(200, 2)) * (1, 0.5), axis=0)
        steps = steps[steps[:, 0] < 800]
        steps[:, 1] += rng.uniform(50, 150)
        at = begin + np.arange(len(steps))
        inside = (at >= 0) & (at < frames)
        direction = 1 if k % 2 else -1
        positions[at[inside], k] = steps[inside] * (direction, 1) + (0 if k % 2 else 800, 0)
        present[at[inside], k] = True
    names = tuple(map(str, range(len(begins))))
    return Trajectories(positions, present, fps=10, individuals=names)


@pytest.fixture(scope="module")
def people():
    """A recording of passing people, and the network that learned from it."""
    pytest.importorskip("torch")
    recording = passing()
    return recording, Network.learned(recording, recording.windows(length_s=2), steps=100)


def test_people_come_and_go_as_they_were_recorded_to(people):
    recording, network = people
    longer = replace(network, steps=200)
    present = np.isfinite(longer.simulate(values(network, 4), np.random.default_rng(1))[..., 0])
    at_once = present.sum(axis=2).mean()
    assert at_once == pytest.approx(recording.present.sum(axis=1).mean(), rel=0.25)
    # nobody needs 20 s for the corridor
    assert not present.all(axis=1).any()
    samples = network(values(network, 20), np.random.default_rng(1))
    assert np.isfinite(samples).all()
    for individuals in (2, 12):
        crowd = network.in_group(individuals, steps=300, settling_steps=100)
        positions = crowd.simulate(values(crowd, 30), np.random.default_rng(1))
        present = np.isfinite(positions[..., 0])
        assert present.sum(axis=2).mean() == pytest.approx(individuals, rel=0.25)


def test_a_sample_may_be_of_one_who_came_later(people):
    _, network = people
    positions, _ = network._paths(values(network, 60), np.random.default_rng(3))
    seen = positions[:, :, 0, 0]
    walked = np.where(seen[:, -1] > seen[:, 0], seen[:, 0], 800 - seen[:, 0])
    # whoever was there at the start has walked for 2 s, some 260 cm
    assert 0.1 < (walked < 200).mean() < 0.9


def speeds(positions):
    """Displacements (cm) in four frames of (F, A, 2) with NaN."""
    moved = np.linalg.norm(positions[4:] - positions[:-4], axis=-1)
    return moved[np.isfinite(moved)]


def test_people_keep_their_speed_and_their_way(people):
    recording, network = people
    longer = replace(network, steps=600)
    positions = longer.simulate(values(network, 2), np.random.default_rng(2))
    walked = np.where(recording.present[..., None], recording.positions, np.nan)
    for group in positions:
        late = group[400:]
        assert np.median(speeds(late)) == pytest.approx(np.median(speeds(walked)), rel=0.1)
        assert np.quantile(speeds(late), 0.1) > 0.8 * np.quantile(speeds(walked), 0.1)
        # whoever has come and gone was on its way to the other end
        last = np.isfinite(group[..., 0]).cumsum(axis=0).argmax(axis=0)
        first = np.isfinite(group[..., 0]).argmax(axis=0)
        passed = np.flatnonzero((first > 0) & (last < len(group) - 1))
        ways = group[last[passed], passed, 0] - group[first[passed], passed, 0]
        assert len(passed) > 20
        assert (np.abs(ways) > 600).mean() > 0.9


def test_nobody_stands_at_a_wall_in_front_of_a_goal_behind_it():
    pytest.importorskip("torch")
    rng = np.random.default_rng(2)
    recording = passing()
    positions = np.array(recording.positions)
    # the corridor has a corner in its middle, around which people are led, each on a lane of its own
    beyond = positions[..., 0] - 400
    lane = positions[..., 1].copy()
    behind = beyond > 0
    positions[..., 0] = np.where(behind, 400 - lane, positions[..., 0] - lane)
    positions[..., 1] = np.where(behind, beyond + lane, lane)
    positions += rng.normal(0, 0.5, positions.shape)
    positions[~recording.present] = 0
    around = replace(recording, positions=positions)
    network = Network.learned(around, around.windows(length_s=2), steps=100)
    longer = replace(network, steps=600)
    moved = longer.simulate(values(network, 4), np.random.default_rng(2))
    steps = np.linalg.norm(np.diff(moved, axis=1), axis=-1)
    assert (steps[np.isfinite(steps)] == 0).mean() < 0.001


def test_another_tank_for_people_who_come_and_go_is_refused(people):
    _, network = people
    with pytest.raises(ValueError, match="`tank_cm` must be None, as individuals come and go"):
        network.in_group(5, (300.0, 200.0))


def test_learning_again_gives_the_same_bits():
    pytest.importorskip("torch")
    recording = recorded(3, steps=1500)
    windows = recording.windows(length_s=2)
    first, second = (Network.learned(recording, windows, steps=50, seed=3) for _ in range(2))
    assert first.to_bytes() == second.to_bytes()


def test_the_kernel_computes_what_was_trained():
    torch = pytest.importorskip("torch")
    from turing_learning.families import _imitation

    torch.manual_seed(1)
    net = _imitation.trainable_network().eval()
    metric = torch.randn(_imitation.WIDTH, _imitation.CONTEXT)
    layers = net.layers(metric)
    rng = np.random.default_rng(1)
    own = rng.normal(size=(1, imitation.OWN)).astype(np.float32)
    traits = rng.normal(size=(1, imitation.MOST_OTHERS, imitation.TRAITS)).astype(np.float32)
    there = np.arange(imitation.MOST_OTHERS)[None] < 3
    with torch.no_grad():
        hidden = net.trunk(*(torch.from_numpy(array) for array in (own, traits, there)))
    context = np.empty((1, _imitation.CONTEXT), dtype=np.float32)
    imitation.contexts(own, traits, np.array([3]), layers, context)
    assert context == pytest.approx((hidden @ metric).numpy(), abs=1e-4)


def off_by(values, recorded):
    """How far each value is from the nearest recorded one."""
    recorded = np.sort(recorded)
    at = np.clip(np.searchsorted(recorded, values), 1, len(recorded) - 1)
    return np.minimum(abs(recorded[at] - values), abs(recorded[at - 1] - values))


def test_a_step_comes_from_the_recording(network):
    """Lengths and turns of simulated steps are recorded ones: nothing is smeared."""
    positions = network.simulate(values(network, 3), np.random.default_rng(4))
    step = np.diff(positions, axis=1)
    lengths = np.linalg.norm(step, axis=-1).ravel()
    assert off_by(lengths, network.brain.pieces.length).max() < 1e-9
    turn = np.diff(np.arctan2(step[..., 1], step[..., 0]), axis=1)
    turn = np.angle(np.exp(1j * turn)).ravel()
    assert off_by(turn, network.brain.pieces.turn).max() < 1e-9


def test_a_run_keeps_its_network(network, tmp_path):
    genuine = network(values(network, 30), np.random.default_rng(8))[:, 0]
    out = tmp_path / "run"
    result = tl.infer(
        genuine=genuine,
        simulate=network,
        parameters=network.parameters,
        signals=network.signals,
        trials=20,
        seed=1,
        out=out,
        should_stop=lambda: True,
    )
    stored = tl.runs.RunFolder(out).network()
    assert stored is not None
    assert stored.to_bytes() == network.to_bytes()
    result = tl.resume(out, genuine=genuine)
    unstopped = tl.infer(
        genuine=genuine,
        simulate=network,
        parameters=network.parameters,
        signals=network.signals,
        trials=20,
        seed=1,
    )
    assert result.estimate == unstopped.estimate
    assert tl.load_run(out).network.to_bytes() == network.to_bytes()


def exit_code(command):
    with pytest.raises(SystemExit) as ended:
        main(command)
    return ended.value.code


def test_the_command_line_learns_a_network_once(network, tmp_path, monkeypatch, capsys):
    learned = []

    def learn(recordings, windows, **options):
        learned.append(options)
        steps = windows.learning.shape[1]
        return replace(network, steps=steps, settling_steps=steps, signals=windows.names)

    monkeypatch.setattr(Network, "learned", learn)
    recording = recorded(5, steps=900)
    table = tmp_path / "fish.csv"
    lines = ["frame,id,x,y"]
    for frame, places in enumerate(recording.positions):
        lines += [f"{frame},{k},{x},{y}" for k, (x, y) in enumerate(places)]
    table.write_text("\n".join([*lines, ""]))
    out = tmp_path / "run"
    command = [
        "infer",
        "--trajectories",
        str(table),
        "--fps",
        "10",
        "--pixels-per-cm",
        "1",
        "--y-axis",
        "up",
    ]
    command += ["--model", "network", "--trials", "20", "--seed", "3", "--out", str(out)]
    assert exit_code(command) == 0
    assert learned[0]["seed"] == 3
    assert len(learned) == 1
    assert (out / "network.safetensors").exists()
    assert exit_code(["show", str(out)]) == 0
    assert "attraction" in capsys.readouterr().out
    result = tl.load_run(out)
    assert result.network.signals == ("speed", "turn", "neighbor_distance", "neighbor_bearing")
    assert len(result.plot.motion()) > 0
    brief = ["--samples", "10", "--points", "0", "--recoveries", "0"]
    assert exit_code(["check", str(out), *brief]) == 0
    assert len(learned) == 1  # not learned again: the folder has it
