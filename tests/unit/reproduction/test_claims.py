import pytest

from turing_learning.reproduction._verdicts import load_claims
from turing_learning.reproduction.experiments import EXPERIMENTS


def test_printed_numbers_can_be_looked_up():
    claim = load_claims()["4.3-aggregation-ae"]
    assert claim.kind == "value"
    assert claim.values["ae_mean"] == [0.01, 0.01, 0.07, 0.06]


def test_a_claim_without_numbers_says_what_is_to_be_seen():
    claim = load_claims()["3.2-snapshots"]
    assert (claim.kind, claim.values) == ("figure", {})
    assert claim.seen == "a single compact cluster at the end of each row"


@pytest.mark.parametrize("section", ["3.2", "4.3", "4.5", "4.6.1", "4.6.2", "4.6.3"])
def test_every_claim_of_a_section_with_an_experiment_is_held_against_it(section):
    of_paper = [name for name in load_claims() if name.partition("-")[0] == section]
    assert list(EXPERIMENTS[section].claims) == of_paper
