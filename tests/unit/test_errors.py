import copy

import numpy as np
import pytest

from turing_learning.arrays import array
from turing_learning.errors import (
    Call,
    Refusal,
    RefusedError,
    Setting,
    choice,
    integer,
    number,
    refuse,
    refusing_as,
    require,
)


class Options:
    def name(self, name):
        return f"--{name}"

    def setting(self, setting):
        return f"--{setting.name}" + ("" if setting.value in (None, True) else f" {setting.value}")

    def call(self, call):
        return f"`turing-learning {call.verb} {call.path}`"


class FolderError(RefusedError):
    pass


def test_a_refusal_says_what_where_the_value_and_the_remedy_in_the_words_of_each_door():
    remedy = (
        "Replace it with ",
        Setting("force", True),
        ", or call ",
        Call("resume", "runs/mine"),
        ".",
    )
    refusal = Refusal("out", "be a new folder", "runs/mine", "a disk", remedy)
    assert str(refusal) == (
        "`out` must be a new folder; got runs/mine [a disk]. Replace it with force=True, or call "
        "`turing_learning.resume('runs/mine')`."
    )
    assert refusal.text(Options()) == (
        "`--out` must be a new folder; got runs/mine [a disk]. Replace it with --force, or call `turing-learning resume runs/mine`."
    )


def test_errors_carry_their_refusal_also_to_another_process():
    with pytest.raises(FolderError, match=r"^`out` must be new; got 'x'\. Choose\.$") as caught:
        refuse("out", "be new", repr("x"), "Choose.", error=FolderError)
    assert (
        copy.copy(caught.value).refusal
        == caught.value.refusal
        == Refusal("out", "be new", "'x'", "", "Choose.")
    )
    assert copy.copy(FolderError("alone")).args == ("alone",)


def test_what_a_block_rejects_becomes_another_error_that_knows_the_place():
    with (
        pytest.raises(
            FolderError, match=r"^`noise` must be 0 or more; got -1 \[robots\.toml:3\]\.$"
        ),
        refusing_as(FolderError, place="robots.toml:3"),
    ):
        require(False, "noise", "be 0 or more", -1)
    with pytest.raises(FolderError, match=r"^plain$"), refusing_as(FolderError):
        raise ValueError("plain")


@pytest.mark.parametrize(
    ("check", "message"),
    [
        (lambda: integer("runs", 0, 1), r"`runs` must be an integer of at least 1; got 0\."),
        (lambda: integer("runs", True), r"`runs` must be an integer of at least 0; got True\."),
        (lambda: integer("runs", 2.0), r"`runs` must be an integer of at least 0; got 2\.0\."),
        (lambda: integer("runs", 10**4400, 1, 9), r"`runs` must be an integer from 1 to 9; got an integer of .* digits\."),
        (lambda: number("rate", float("nan"), above=0), r"`rate` must be a finite number above 0; got nan\."),
        (lambda: number("rate", "3"), r"`rate` must be a finite number; got '3'\."),
        (lambda: number("rate", 10**400), r"`rate` must be a finite number; got an integer of .* digits\."),
        (lambda: number("share", 1.5, least=0, most=1), r"`share` must be .* of at least 0 and of at most 1; got 1\.5\."),
        (lambda: choice("kind", "b", ("a", "c")), r"`kind` must be one of a, c; got 'b'\."),
        (lambda: choice("kind", "rde", ("red",), noun="color"), r"`kind` must be a known color; got 'rde'\. Did you mean `red`\?"),
        (lambda: choice("kind", 5, ("red",), noun="color"), r"`kind` must be a known color; got 5\. Choose from: red\."),
    ],
)  # fmt: skip
def test_numbers_and_names_are_rejected_in_one_line(check, message):
    with pytest.raises(RefusedError, match=f"^{message}$"):
        check()


def test_what_fits_is_returned_as_plain_numbers():
    assert integer("runs", np.int64(3), 1) == 3
    assert type(integer("runs", np.int64(3))) is int
    assert number("rate", np.float32(0.5), above=0) == 0.5
    assert choice("kind", "a", ("a",)) == "a"


@pytest.mark.parametrize(
    ("value", "shape", "options", "message"),
    [
        (np.zeros((2, 3)), "K T D", {}, r"`x` must be of shape \(K, T, D\); got \(2, 3\)\."),
        (
            np.zeros((2, 3)),
            "M P",
            {"P": 4},
            r"`x` must be of shape \(M, P\) = \(any, 4\); got \(2, 3\)\.",
        ),
        (
            np.zeros((0, 3)),
            "M P",
            {},
            r"`x` must be of shape \(M, P\) and not empty; got \(0, 3\)\.",
        ),
        (np.zeros((2, 3)), "P P", {}, r"`x` must be of shape \(P, P\); got \(2, 3\)\."),
        ([[1.0], [1.0, 2.0]], "M P", {}, r"`x` must be an array of shape \(M, P\); got a list\."),
        (["a"], "P", {}, r"`x` must be an array of numbers; got an array of <U1\."),
        ([1j], "P", {}, r"`x` must be an array of numbers; got an array of complex128\."),
        ([0.0, np.nan], "P", {}, r"`x` must be finite; got nan at \(1,\) of \(P,\)\."),
        (
            [0.7],
            "P",
            {"dtype": np.int64},
            r"`x` must be an array of integers; got an array of float64\.",
        ),
        (
            [2],
            "P",
            {"dtype": bool},
            r"`x` must be an array of truth values; got an array of int64\.",
        ),
        (
            np.ma.masked_array([1.0, 2.0], [0, 1]),
            "P",
            {},
            r"`x` must have no masked values; got a masked array\. Fill them.*",
        ),
    ],
)
def test_arrays_are_rejected_in_one_line(value, shape, options, message):
    with pytest.raises(RefusedError, match=f"^{message}$"):
        array("x", value, shape, **options)


def test_arrays_that_fit_are_converted_without_loss():
    given = np.ones((2, 3))
    assert array("x", given, "M P") is given
    assert array("x", [[1, 2]], "M P", P=2).dtype == np.float64
    assert array("x", [1.0, 2.0], "P", dtype=np.int64).tolist() == [1, 2]
    assert array("x", np.zeros((4, 5, 2)), "... D", D=2).shape == (4, 5, 2)
    assert array("x", np.zeros((0, 2)), "S D", empty=True).shape == (0, 2)
    assert np.isnan(array("x", [np.nan], "P", finite=False)).all()
