"""The example of docs/interaction.md, shortened, runs as it stands there."""

import re
from pathlib import Path

PAGE = Path(__file__).parents[2] / "docs" / "interaction.md"


def test_the_system_of_the_page_is_inferred():
    (code,) = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    body = code[code.index("def eye") : code.index("result =")].rstrip().splitlines()
    assert len(body) <= 10
    known: dict = {}
    exec(code.replace("generations=200", "generations=5, settings={'run.history': 'thin'}"), known)  # noqa: S102
    assert set(known["result"].truth) == {"rate", "gain"}
    assert known["result"].complete
