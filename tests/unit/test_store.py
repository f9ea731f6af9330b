"""A folder that can be resumed: what happens to it, and what it says."""

import json
import logging
import os
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from turing_learning import store as module
from turing_learning.store import (
    DamagedError,
    FolderKind,
    RunFolderError,
    RunStorageError,
    Store,
    digest_of,
    storage,
)

KIND = FolderKind("search", "search.json", identity=("settings",), newest=2)
CONTENTS = {
    "rounds/one.json": {"a": [1, 2.5]},
    "two.npy": np.arange(6.0).reshape(2, 3),
    "three.txt": b"three",
}


@pytest.fixture
def store(tmp_path):
    made = Store(tmp_path / "s", KIND)
    made.create({"settings": {"seed": 1}, "state": "running"})
    for name, content in CONTENTS.items():
        made.write(name, content)
    return made


def fresh(store):
    return Store(store.path, KIND)


def damaged(store, names):
    """Return the names of files that are missing, or not as they were written."""
    found = set()
    for name in names:
        try:
            store.read(name)
        except DamagedError:
            found.add(name)
    return found


def warnings(caplog):
    return [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]


def test_what_is_written_is_read(store, caplog):
    store.write("arrays.npz", {"x": np.eye(2, dtype=np.float32)})
    again = fresh(store)
    assert again.head() == {"format_version": 2, "settings": {"seed": 1}, "state": "running"}
    assert again.read("rounds/one.json") == {"a": [1, 2.5]}
    np.testing.assert_array_equal(again.read("two.npy"), CONTENTS["two.npy"], strict=True)
    np.testing.assert_array_equal(
        again.read("arrays.npz")["x"], np.eye(2, dtype=np.float32), strict=True
    )
    assert again.read("three.txt") == b"three"
    assert damaged(again, [*CONTENTS, "search.json"]) == set()
    assert warnings(caplog) == []


@pytest.mark.parametrize(
    ("repeats", "arrays"),
    [
        (True, {"counts": np.random.default_rng(1).poisson(3.0, (50, 100, 2)).astype(float)}),
        (True, {"steps": np.repeat(np.random.default_rng(2).standard_normal((50, 10)), 10, 1)}),
        (False, {"motion": np.random.default_rng(3).standard_normal((50, 100, 2))}),
        # a file is as most of its bytes, wherever they are
        (False, {"row": np.arange(9), "motion": np.random.default_rng(4).random((50, 100, 2))}),
        (True, {"row": np.random.default_rng(5).random(99), "zeros": np.zeros((50, 100, 2))}),
    ],
)  # fmt: skip
def test_arrays_are_compressed_where_that_halves_them_and_read_as_they_were(repeats, arrays, store):
    store.write("arrays.npz", arrays)
    raw = sum(array.nbytes for array in arrays.values())
    with zipfile.ZipFile(store.path / "arrays.npz") as archive:
        kinds = {member.compress_type for member in archive.infolist()}
    assert kinds == {zipfile.ZIP_DEFLATED if repeats else zipfile.ZIP_STORED}
    assert ((store.path / "arrays.npz").stat().st_size < raw / 2) == repeats
    again = fresh(store).read("arrays.npz")
    assert again.keys() == arrays.keys()
    for name, array in arrays.items():
        np.testing.assert_array_equal(again[name], array, strict=True)


def test_tables_are_csv_and_other_things_are_refused(store):
    pandas = pytest.importorskip("pandas")
    store.write("t.csv", pandas.DataFrame({"a": [1, 2], "b": [0.1, None]}))
    assert store.read("t.csv") == b"a,b\n1,0.1\n2,\n"
    with pytest.raises(TypeError, match=r"^a\.xyz must be \.json"):
        store.write("a.xyz", {"a": 1})
    with pytest.raises(ValueError, match="JSON"):
        store.write("nan.json", {"a": float("nan")})
    with pytest.raises(ValueError, match="allow_pickle"):
        store.write("objects.npy", np.array([object()]))


def flip(path):
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def become_a_folder(path):
    path.unlink()
    path.mkdir()


DAMAGES = {
    "flipped": flip,
    "cut": lambda path: path.write_bytes(path.read_bytes()[:-3]),
    "empty": lambda path: path.write_bytes(b""),
    "longer": lambda path: path.write_bytes(path.read_bytes() + b" "),
    "foreign": lambda path: path.write_bytes(b'{"a": 1}'),
    "brackets": lambda path: path.write_bytes(b"[" * 200_000),
    "folder": become_a_folder,
    "missing": lambda path: path.unlink(),
}


@pytest.mark.parametrize("damage", DAMAGES)
@pytest.mark.parametrize("name", [*CONTENTS, "search.json"])
def test_every_damage_is_named_and_nothing_wrong_is_returned(name, damage, store, monkeypatch):
    monkeypatch.setattr(module, "_ATTEMPTS", 1)
    DAMAGES[damage](store.path / name)
    with pytest.raises(
        DamagedError,
        match=rf"^`search` must hold {name} as it was written; got .*{name} \(.+\)\. Restore",
    ):
        fresh(store).read(name)
    if name == "search.json":
        with pytest.raises(RunFolderError, match=r"search\.json"):
            fresh(store).head()


@pytest.mark.parametrize("damage", sorted(set(DAMAGES) - {"missing"}))
@pytest.mark.parametrize("name", ["rounds/one.json", "two.npy"])
def test_a_damaged_piece_is_set_aside_and_made_again(name, damage, store, monkeypatch, caplog):
    monkeypatch.setattr(module, "_ATTEMPTS", 1)
    for number in (1, 2):
        DAMAGES[damage](store.path / name)
        again = fresh(store)
        np.testing.assert_equal(again.once(name, lambda: CONTENTS[name]), CONTENTS[name])
        aside = store.path / f"{name}.damaged{'' if number == 1 else '-2'}"
        assert aside.exists()
        assert f"{name} is damaged (" in warnings(caplog)[-1]
        assert f"it is made again. The damaged file is {aside.name}." in warnings(caplog)[-1]
    np.testing.assert_equal(fresh(store).read(name), CONTENTS[name])


def test_a_piece_is_made_once_and_one_that_was_stopped_leaves_nothing(store):
    calls = []
    for _ in range(2):
        assert fresh(store).once("piece.json", lambda: calls.append(1) or {"v": 7}) == {"v": 7}
    assert calls == [1]
    assert store.once("stopped.json", lambda: None) is None
    assert not (store.path / "stopped.json").exists()


def test_files_that_change_places_are_damaged(store):
    store.write("other.npy", np.zeros((2, 3)))
    (store.path / "other.npy").replace(store.path / "two.npy")
    with pytest.raises(DamagedError, match="it has been changed"):
        fresh(store).read("two.npy")


def test_a_file_nobody_wrote_is_foreign(store):
    np.save(store.path / "nobody.npy", np.zeros(3))
    with pytest.raises(DamagedError, match=r"seals\.txt does not know it"):
        fresh(store).read("nobody.npy")


def test_the_files_and_seals_of_another_store_are_foreign(store, tmp_path):
    other = Store(tmp_path / "other", KIND)
    other.create({"settings": {"seed": 2}})
    other.write("two.npy", np.zeros((2, 3)))
    for name in ("two.npy", "seals.txt"):
        shutil.copy(other.path / name, store.path / name)
    for name in ("two.npy", "search.json"):
        with pytest.raises(DamagedError, match=r"seals\.txt is damaged, or that of another search"):
            fresh(store).read(name)


def test_a_store_whose_seals_are_removed_is_refused_and_stays_unsealed(store):
    (store.path / "seals.txt").unlink()
    for call in (fresh(store).head, lambda: fresh(store).read("rounds/one.json")):
        with pytest.raises(DamagedError, match=r"\(seals\.txt is missing\)"):
            call()
    with fresh(store).locked():
        pass
    assert not (store.path / "seals.txt").exists()


def test_a_head_whose_seal_is_removed_is_refused(store):
    path = store.path / "seals.txt"
    lines = path.read_text().splitlines(keepends=True)
    path.write_text("".join(line for line in lines if "search.json" not in line))
    with pytest.raises(DamagedError, match=r"search\.json \(seals\.txt does not know it\)"):
        fresh(store).head()
    assert fresh(store).read("rounds/one.json") == CONTENTS["rounds/one.json"]


def test_what_identifies_a_store_cannot_be_changed(store):
    content = (store.path / "search.json").read_text()
    (store.path / "search.json").write_text(content.replace('"seed": 1', '"seed": 2'))
    with pytest.raises(DamagedError, match=r"search\.json"):
        fresh(store).head()


def test_every_single_damage_of_the_index_is_noticed_or_harmless(store, monkeypatch):
    monkeypatch.setattr(module, "_ATTEMPTS", 1)
    path = store.path / "seals.txt"
    sound = path.read_bytes()
    for place in range(0, len(sound), 2):
        path.write_bytes(sound[:place] + bytes([sound[place] ^ 1]) + sound[place + 1 :])
        again = fresh(store)
        for name, content in CONTENTS.items():
            try:
                np.testing.assert_equal(again.read(name), content)
            except DamagedError:
                continue
    for end in range(len(sound)):
        path.write_bytes(sound[:end])
        damaged(fresh(store), CONTENTS)


def test_an_index_that_was_cut_goes_on(store):
    path = store.path / "seals.txt"
    path.write_bytes(path.read_bytes()[:-10])
    again = fresh(store)
    again.write("new.json", {"a": 1})
    assert damaged(fresh(store), [*CONTENTS, "new.json"]) == {"three.txt"}


@pytest.mark.parametrize("fails", ["seal", "file"])
def test_a_write_that_is_cut_short_again_and_again_leaves_the_earlier_file_sound(
    fails, store, monkeypatch
):
    class Killed(Exception):
        pass

    def killed(*_):
        raise Killed

    for number in range(4):
        with monkeypatch.context() as patch:
            patch.setattr(module, "write_atomically", killed) if fails == "file" else patch.setattr(
                os, "fsync", killed
            )
            again = fresh(store)
            with pytest.raises(Killed):
                again.write("rounds/one.json", {"number": number})
        assert fresh(store).read("rounds/one.json") == CONTENTS["rounds/one.json"]
    fresh(store).write("rounds/one.json", {"number": 5})
    assert fresh(store).read("rounds/one.json") == {"number": 5}


def test_a_reader_beside_a_writer_sees_one_sound_version(store):
    reader = fresh(store)
    reader.read("rounds/one.json")
    for number in range(5):
        store.write("rounds/one.json", {"number": number})
    assert reader.read("rounds/one.json") == {"number": 4}


def test_the_index_does_not_grow_without_bound(store, monkeypatch):
    monkeypatch.setattr(os, "fsync", lambda descriptor: None)
    for number in range(2000):
        store.seals.append([("rounds/one.json", digest_of(str(number).encode()))])
    assert len((store.path / "seals.txt").read_text().splitlines()) < 400
    assert "two.npy" in fresh(store).seals


def test_a_removed_file_has_no_seal(store):
    store.remove("two.npy")
    store.remove("never.npy")
    assert not (store.path / "two.npy").exists()
    assert "two.npy" not in fresh(store).seals


@pytest.mark.parametrize(
    ("version", "message"),
    [
        (0, "`format_version` must be an integer of at least 1; got 0 ["),
        (-1, "`format_version` must be an integer of at least 1; got -1 ["),
        (3, "`format_version` must be at most 2; got 3 ["),
    ],
)
def test_formats_that_are_not_known_are_refused(version, message, tmp_path):
    (tmp_path / "search.json").write_text(json.dumps({"format_version": version}))
    with pytest.raises(RunFolderError) as caught:
        Store(tmp_path, KIND).head()
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"format_version": "1"}', '{"format_version": true}', "\x00", "[" * 200_000],
)
def test_a_folder_that_is_something_else_is_refused(text, tmp_path):
    (tmp_path / "search.json").write_text(text)
    with pytest.raises(
        RunFolderError,
        match=r"^`search` must be a search folder; got .* without a readable search\.json\.",
    ):
        Store(tmp_path, KIND).head()
    assert not Store(tmp_path, KIND).exists()


def test_two_processes_do_not_write_to_one_folder(store):
    code = f"""
from turing_learning.store import FolderKind, RunFolderError, Store
store = Store({str(store.path)!r}, FolderKind("search", "search.json"))
try:
    with store.locked():
        print("held")
except RunFolderError as error:
    print(error)
"""
    with store.locked():
        said = subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout
        assert said.startswith(
            f"`search` must not be in use; got {store.path}, to which another process is writing."
        )
    assert (
        subprocess.run(
            [sys.executable, "-c", code], capture_output=True, text=True, check=True
        ).stdout
        == "held\n"
    )


def test_the_process_that_holds_a_folder_is_named_where_its_head_says_it(store):
    store.write("search.json", store.head() | {"process": {"pid": 7, "host": "here"}})
    with (
        store.locked(),
        pytest.raises(RunFolderError, match="to which process 7 on here is writing"),
        fresh(store).locked(),
    ):
        pass


def renamed(path):
    path.rename(path.with_name("elsewhere"))


def replaced(path):
    renamed(path)
    path.mkdir()


@pytest.mark.parametrize("move", [renamed, replaced, shutil.rmtree])
def test_a_folder_that_moves_while_it_is_written_is_noticed(move, store):
    with store.locked():
        store.write("before.json", {"a": 1})
        move(store.path)
        for write in (
            lambda: store.write("after.json", {"a": 1}),
            lambda: store.once("after.json", lambda: {"a": 1}),
            lambda: store.remove("before.json"),
        ):
            with pytest.raises(
                RunStorageError, match=r"^`search` must stay where it is while it is written; got "
            ):
                write()
    assert not (store.path / "after.json").exists()


def test_a_full_disk_is_said_with_what_to_do(tmp_path):
    with (
        pytest.raises(
            RunStorageError,
            match=r"^`out` must be a folder with space left; could not write to .*\. Make room, then go",
        ),
        storage(tmp_path, "go on."),
    ):
        raise OSError(28, "No space left on device")


def test_a_head_that_is_lost_while_the_folder_is_held_is_written_again(store, caplog):
    head = store.head()
    with store.locked():
        store.head_path.unlink()
        store.write("two.npy", np.zeros(1))
    assert fresh(store).head() == head
    assert warnings(caplog) == [f"{store.head_path} was missing; it is written again."]


def test_a_store_that_is_held_stays_where_it_is_wherever_the_process_goes(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    store = Store("relative", KIND)
    store.create({"settings": {"seed": 1}})
    (tmp_path / "elsewhere").mkdir()
    with store.locked():
        monkeypatch.chdir(tmp_path / "elsewhere")
        store.write("three.txt", b"three")
    assert (tmp_path / "relative" / "three.txt").read_bytes() == b"three"
    assert not list(Path().iterdir())
