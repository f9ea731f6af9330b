"""A process that writes to a store is killed again and again: nothing sound is ever called damaged, and nothing is lost."""

import random
import subprocess
import sys
import time

from turing_learning.store import FolderKind, Store

KIND = FolderKind("search", "search.json", identity=("a",))
WRITER = """
import sys
from turing_learning.store import FolderKind, Store
store = Store(sys.argv[1], FolderKind("search", "search.json", identity=("a",)))
store.path.mkdir(parents=True, exist_ok=True)
with store.locked():
    if not store.exists():
        store.create({"a": 1})
    k = 0
    while True:
        k += 1
        for n in range(5):
            store.write(f"f{n}.json", {"k": k, "n": n})
        if k == 1:
            print("written", flush=True)
"""


def test_a_store_whose_writer_is_killed_at_any_moment_is_sound(tmp_path):
    rng = random.Random(1)
    for kill in range(12):
        process = subprocess.Popen(
            [sys.executable, "-c", WRITER, tmp_path / "s"], stdout=subprocess.PIPE
        )
        if kill % 3:
            process.stdout.readline()
            time.sleep(rng.random() * 0.05)
        else:
            time.sleep(rng.random())
        process.kill()
        process.communicate()
        store = Store(tmp_path / "s", KIND)
        names = [path.name for path in store.path.glob("f*.json")]
        assert not store.exists() or store.head()["a"] == 1
        assert all(store.read(name)["n"] == int(name[1]) for name in names)
    assert len(names) == 5
