"""The states P1 to P5 against a laboratory in virtual time, and every fault that a laboratory can have."""

import re

import numpy as np
import pytest
from program_laboratory import FILE, NAMES, ScriptedLaboratory, new_tracker

from turing_learning.robots import LaboratoryError, LaboratorySource, load_laboratory
from turing_learning.robots._link import LARGEST_SEQUENCE, Model
from turing_learning.robots.program._equipment import TerminalOperator

MODELS = np.array(
    [(-0.5, 0.3, 0.0, 0.0), (1.0, 0.2, 0.0, 0.0), (-1.0, -0.2, 0.0, 0.0), (0.3, -0.3, 0.0, 0.0)]
)


@pytest.fixture(scope="module")
def shared_tracker():
    return new_tracker()


class Run:
    """One generation in a scripted laboratory, whose robots are already in their loops."""

    def __init__(self, tracker, file, tmp_path):
        path = tmp_path / "lab.toml"
        path.write_text(file)
        laboratory = load_laboratory(path)
        self.lab = ScriptedLaboratory()
        self.lab.press_remote()
        self.lab.clock.sleep(3.0)
        self.states, self.events, self.trials = [], [], []
        self.actions = {}
        self.source = LaboratorySource(
            laboratory.setup,
            laboratory.configuration.scenario,
            self.lab.equipment(tracker),
            watch=self._watch,
        )

    def _watch(self, event):
        if event.kind == "trial":
            self.trials.append((event.attempt, event.trial))
        elif event.kind == "state":
            self.states.append((round(self.lab.clock.now(), 2), event.state))
            for action in self.actions.pop(event.state, []):
                action()
        else:
            self.events.append(event)

    def at(self, state, action, count=1):
        """Do something when a state is entered for the `count`-th time from now."""

        def wait(left=count):
            if left > 1:
                self.actions.setdefault(state, []).append(lambda: wait(left - 1))
            else:
                action()

        self.actions.setdefault(state, []).append(wait)

    def collect(self, models=MODELS):
        return self.source.collect(models, np.random.default_rng(0))

    @property
    def disturbed(self):
        return [event for event in self.events if event.kind == "disturbed"]


@pytest.fixture
def run(shared_tracker, tmp_path):
    return Run(shared_tracker, FILE, tmp_path)


@pytest.fixture(scope="module")
def undisturbed(shared_tracker, tmp_path_factory):
    return Run(shared_tracker, FILE, tmp_path_factory.mktemp("lab")).collect()


def require_same(samples, expected):
    """Samples agree to what the camera resolves; a trial of other models, or of half a trial, would not."""
    np.testing.assert_allclose(samples.genuine, expected.genuine, atol=0.3)
    np.testing.assert_allclose(samples.counterfeit, expected.counterfeit, atol=0.3)


def test_samples_are_those_of_the_agents_in_all_trials_and_of_each_model(run):
    samples = run.collect()
    assert samples.genuine.shape == (4, 10, 2)
    assert samples.counterfeit.shape == (4, 1, 10, 2)
    left, right = np.tanh(MODELS[:, :2]).T
    np.testing.assert_allclose(
        samples.counterfeit[:, 0, :, 1].mean(axis=1), right - left, atol=0.08
    )
    assert np.allclose(samples.genuine[..., 1].mean(axis=1), -0.3, atol=0.05)
    assert np.allclose(samples.genuine[..., 0].mean(axis=1), -0.85, atol=0.05)


def test_the_states_follow_the_replicas_signals(run):
    run.collect()
    names = [state for _, state in run.states]
    assert names == ["P0", "P1", "P2", "P3", "P4", "P5", "P1", "P2", "P3", "P4", "P5", "P1"]
    times = dict(enumerate(time for time, _ in run.states))
    stop = 1.0 + 18.0  # the loop began at 1 s, and the program came after its STOP
    assert times[2] == pytest.approx(stop, abs=0.1)
    assert times[4] == pytest.approx(stop + 10.0, abs=0.1)  # START
    assert times[5] == pytest.approx(
        stop + 10.0 + 1.0 + 3.0 + 1.0, abs=0.2
    )  # the middle second of seven, after a wait of 1 s
    assert times[7] == pytest.approx(stop + 18.0, abs=0.1)
    assert run.lab.asked == []


def test_models_travel_as_their_tanh_in_the_order_of_the_trials(run):
    run.collect()
    np.testing.assert_allclose(
        np.concatenate([trial.models for _, trial in run.trials]), np.tanh(MODELS), atol=5e-5
    )
    assert [trial.sequences for _, trial in run.trials] == [(0, 1), (2, 3)]
    assert [attempt for attempt, _ in run.trials] == [1, 1]


def test_numbers_of_models_begin_again_after_the_largest(run):
    for name, sequence in zip(NAMES, (LARGEST_SEQUENCE, LARGEST_SEQUENCE - 1), strict=True):
        run.lab.wires[name].robot.executing = Model(sequence, (0.5, 0.2, 0.0, 0.0))
    run.collect()
    assert [trial.sequences for _, trial in run.trials] == [(0, 1), (2, 3)]
    assert run.disturbed == []


def test_the_next_generation_begins_with_the_loop_that_follows(run):
    run.collect()
    run.source.generation = 1
    run.collect()
    stops = [time for time, state in run.states if state == "P2"]
    np.testing.assert_allclose(np.diff(stops), 18.0, atol=0.1)


def test_robots_that_have_not_begun_are_started_by_the_operator(run):
    run.lab._round += 1  # nobody's loop goes on
    for wire in run.lab.wires.values():
        wire.robot.enter("R0")
    run.collect()
    (asked,) = run.lab.asked
    assert (
        asked
        == "Replica r1 has not begun. Put all robots in their places, and press the remote control."
    )


def cut(run):
    run.lab.wires[NAMES[1]].cut = True


@pytest.mark.parametrize(
    ("state", "observed"),
    [("P1", [0, 0, 1]), ("P2", [0, 1]), ("P3", [0, 1]), ("P4", [0, 1, 1]), ("P5", [0, 1, 1])],
)
def test_a_link_lost_in_any_state_repeats_trials_that_are_not_confirmed(
    run, state, observed, undisturbed
):
    run.at(state, lambda: cut(run), count=2)
    samples = run.collect()
    assert run.disturbed[0].fault.startswith("the link to replica r2 is lost (")
    assert any("see to its link" in asked for asked in run.lab.asked)
    assert [trial.number for _, trial in run.trials] == observed
    require_same(samples, undisturbed)


@pytest.mark.parametrize("seconds", [1.0, 10.0, 25.0])
def test_a_link_that_comes_back_by_itself_needs_no_operator(run, undisturbed, seconds):
    wire = run.lab.wires[NAMES[0]]

    def lose():
        wire.cut = True
        run.lab.clock.call_at(run.lab.clock.now() + seconds, lambda: setattr(wire, "cut", False))

    run.at("P3", lose)
    samples = run.collect()
    assert run.lab.asked == []
    assert {event.asked for event in run.disturbed} == {""}
    require_same(samples, undisturbed)


def test_garbage_on_the_line_changes_nothing(run, undisturbed):
    def spoil():
        for wire in run.lab.wires.values():
            wire.noise = b"\xff\x00x,START,9,9*0000\r\n\x80zz\r\nx,S"

    for state in ("P1", "P2", "P3", "P4"):
        run.at(state, spoil)
    require_same(run.collect(), undisturbed)


def test_garbage_inside_a_signal_is_a_missed_signal(run, undisturbed):
    run.at("P3", lambda: setattr(run.lab.wires[NAMES[0]], "noise", b"x,ST"))
    samples = run.collect()
    assert run.disturbed[0].fault == "START has not come from r1"
    assert run.disturbed[0].state == "P3"
    require_same(samples, undisturbed)


def test_replies_cut_in_two_change_nothing(run, undisturbed):
    for wire in run.lab.wires.values():
        wire.halve = True
    samples = run.collect()
    assert run.disturbed == []
    require_same(samples, undisturbed)


def test_a_replica_that_never_signals_is_told_to_the_operator(run, undisturbed):
    run.at("P1", lambda: setattr(run.lab.wires[NAMES[0]], "silent", True), count=2)
    samples = run.collect()
    assert run.disturbed[0].fault == "STOP has not come from r1"
    assert [bool(event.asked) for event in run.disturbed] == [False, False, True]
    assert run.lab.asked[0].startswith(
        "STOP has not come from r1. The trial will be repeated. See to the replicas"
    )
    require_same(samples, undisturbed)


def test_a_signal_that_was_missed_is_noticed_by_the_count_of_trials(run):
    def skip():
        run.lab.wires[NAMES[1]].robot.signal(
            "START"
        )  # the replica's count goes on, and nobody hears it

    run.at("P3", skip)
    run.collect()
    assert (
        run.disturbed[0].fault
        == "START of trial 3 has come from r2, 2 was expected: one was missed"
    )


def test_another_model_than_the_one_sent_is_noticed(run, undisturbed):
    from turing_learning.robots import Model

    def replace():
        robot = run.lab.wires[NAMES[0]].robot
        run.lab.clock.call_at(
            run.lab.clock.now() + 9.5, lambda: setattr(robot, "executing", Model(999, (0.1,) * 4))
        )

    run.at("P3", replace)
    samples = run.collect()
    assert run.disturbed[0].fault == "replica r1 executes model 999, 0 was sent"
    require_same(samples, undisturbed)


@pytest.mark.parametrize(
    ("state", "count", "change", "fault", "asked"),
    [
        ("P4", 1, lambda lab: setattr(lab, "covered", (2,)), "0 orange markers in the first image, 1 exp", "Check its marker"),
        ("P4", 2, lambda lab: setattr(lab, "carried", 3), r"individual 3 \(purple\) cannot have .* it was carried away", ""),
        ("P4", 1, lambda lab: setattr(lab, "stuck", (1,)), r"individual 1 \(blue\) has not .* stuck, or its battery is emp", ""),
        ("P4", 1, lambda lab: lab.after(4.52, "frozen", True), "the camera is frozen: image 5 is", "Restart the camera."),
        ("P4", 1, lambda lab: setattr(lab, "dead_camera", True), "`source` must give images; got none", "Look after the camera."),
        ("P2", 2, lambda lab: setattr(lab.bodies[0], "battery", False), "replica r1 has a low battery", "Change the battery"),
    ],
)  # fmt: skip
def test_a_fault_is_named_and_its_trial_is_not_used(
    run, undisturbed, state, count, change, fault, asked
):
    run.at(state, lambda: change(run.lab), count)
    samples = run.collect()
    assert re.match(fault, run.disturbed[0].fault)
    assert asked in run.lab.asked[-1]
    assert [trial.number for _, trial in run.trials if not trial.faults] == [0, 1]
    assert len({attempt for attempt, trial in run.trials if not trial.faults}) == 1
    require_same(samples, undisturbed)


def leaving_out(run, share):
    """Let the camera lose a share of its images."""
    take, rng = run.lab.take, np.random.default_rng(7)

    def lossy():
        run.lab._next_image += 0.1 * (rng.random() < share)
        return take()

    run.lab.take = lossy
    return take


def test_a_trial_of_which_an_image_was_lost_is_repeated_at_once(run, undisturbed):
    take = leaving_out(run, 1.0)
    run.at("P4", lambda: setattr(run.lab, "take", take), count=2)
    samples = run.collect()
    assert run.disturbed[0].fault.startswith(
        "`camera` must give an image every 0.1 s; got one left out before image"
    )
    assert [(trial.number, bool(trial.faults)) for _, trial in run.trials] == [
        (0, True),
        (0, False),
        (1, False),
    ]
    started = [trial.started_s for _, trial in run.trials]
    np.testing.assert_allclose(np.diff(started), 18.0, atol=0.1)  # no loop of the robots is lost
    assert run.lab.asked == []
    require_same(samples, undisturbed)


def test_a_camera_that_loses_images_now_and_then_wakes_nobody(run, undisturbed):
    leaving_out(run, 0.05)  # as 1 % of the 51 images of a trial in the paper
    for _ in range(4):
        require_same(run.collect(), undisturbed)
    assert run.disturbed
    assert run.lab.asked == []


def test_a_camera_that_loses_all_the_time_is_told_to_the_operator(run):
    take = leaving_out(run, 0.5)
    run.lab.on_ask = lambda what: setattr(run.lab, "take", take)
    run.collect()
    (asked,) = run.lab.asked
    assert (
        "The trial will be repeated. Look after the camera and the PC: `camera` must give an image every"
        in asked
    )
    assert len(run.disturbed) == 11


def test_a_marker_that_was_out_of_sight_for_a_moment_wakes_nobody(run, undisturbed):
    run.at("P4", lambda: run.lab.after(4.3, "covered", (3,)) or run.lab.after(4.55, "covered", ()))
    require_same(run.collect(), undisturbed)
    assert "individual 3 (purple) is out of sight" in run.disturbed[0].fault
    assert run.lab.asked == []


def test_a_jump_of_nearly_all_robots_at_once_is_one_of_the_camera(run, undisturbed):
    poses = run.lab.poses
    run.at(
        "P4", lambda: run.lab.after(4.52, "poses", lambda: poses() + np.array([12.0, 12.0, 0.0]))
    )
    run.at("P5", lambda: setattr(run.lab, "poses", poses))
    require_same(run.collect(), undisturbed)
    assert "cannot have moved" in run.disturbed[0].fault
    assert len(run.disturbed) == 1
    assert run.lab.asked == []


def test_a_replica_whose_model_stands_still_is_not_stuck(run):
    run.collect(np.array([(0.0, 0.0, 0.0, 0.0)] * 4))
    assert run.disturbed == []


def test_replicas_out_of_step_are_started_again(run, undisturbed):
    wire = run.lab.wires[NAMES[0]]
    come = wire.come

    def late(data):
        clock = run.lab.clock
        clock.call_at(clock.now() + (1.4 if b"STOP" in data else 0.0), lambda: come(data))

    run.at("P1", lambda: setattr(wire, "come", late))
    run.lab.on_ask = lambda what: setattr(wire, "come", come)
    samples = run.collect()
    assert run.disturbed[0].fault == "the replicas are 1.4 s out of step"
    assert "Put all robots in their places, and press the remote control." in run.lab.asked[0]
    require_same(samples, undisturbed)


def test_all_batteries_are_replaced_every_so_many_generations(shared_tracker, tmp_path):
    run = Run(shared_tracker, FILE.replace("batteries_every = 0", "batteries_every = 2"), tmp_path)
    for generation in range(5):
        run.source.generation = generation
        run.collect()
    asked = [event.stage for event in run.events if event.kind == "batteries"]
    assert asked == ["generation-0002", "generation-0004"]
    assert run.lab.asked[0].startswith("Replace the batteries of all robots; then put all robots")


def test_an_operator_who_is_away_ends_the_session(monkeypatch):
    def nobody(prompt):
        raise EOFError

    monkeypatch.setattr("builtins.input", nobody)
    with pytest.raises(LaboratoryError, match=r"nobody answers at the terminal\. To do: Free it"):
        TerminalOperator().ask("Free it.")


def test_an_operator_presses_enter(monkeypatch):
    shown = []
    monkeypatch.setattr("builtins.input", lambda prompt: shown.append(prompt) or "")
    TerminalOperator().ask("Free robot 3.")
    assert "Free robot 3." in shown[0]
    assert "Press Enter when it is done" in shown[0]


def test_the_operator_is_told_the_first_faults_of_a_trial_and_how_many_more_there_are(run):
    run.at("P4", lambda: setattr(run.lab, "covered", (0, 1, 2, 3)))
    run.collect()
    (asked,) = run.lab.asked
    assert asked.count("is missing. Check its marker.") == 1 + 3  # the fault, and the first of all
    assert (
        "And 1 more; if they are of nearly all robots, look after the camera and the PC. Then put all"
        in asked
    )


def halted(run):
    return {name: wire.robot.state == "R0" for name, wire in run.lab.wires.items()}


def test_robots_stand_when_the_program_ends_or_fails(run):
    with run.source:
        run.collect()
    assert halted(run) == {"r-orange": True, "r-purple": True}
    run.lab.press_remote()
    run.lab.clock.sleep(3.0)
    run.at("P3", lambda: (_ for _ in ()).throw(KeyboardInterrupt))
    with pytest.raises(KeyboardInterrupt), run.source:
        run.collect()
    assert halted(run) == {"r-orange": True, "r-purple": True}
    assert all(event.kind != "moving" for event in run.events)


def test_robots_that_cannot_be_halted_are_said_to_be_moving(run, caplog):
    with run.source:
        run.collect()
        run.lab.wires["r-orange"].cut = True
    assert halted(run)["r-purple"]
    assert run.events[-1].kind == "moving"
    assert caplog.messages == ["robots are still moving: r1. Switch them off."]


def test_robots_that_were_never_reached_are_left_alone(run, caplog):
    run.lab.wires["r-orange"].cut = run.lab.wires["r-purple"].cut = True
    run.source.close()
    assert caplog.messages == []


def test_a_replica_that_stood_in_its_last_trial_is_waited_for(run):
    wires = run.lab.wires.values()
    run.lab.clock.sleep(
        11.0
    )  # to R5, from which no STOP comes: `check` has closed its links before, and the replicas stood
    for wire in wires:
        wire.silent = True
    for wire in wires:
        run.lab.clock.call_at(20.0, lambda wire=wire: setattr(wire, "silent", False))
    run.collect()
    assert run.disturbed == []
