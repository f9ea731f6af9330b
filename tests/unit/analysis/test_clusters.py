import numpy as np

from turing_learning.analysis import largest_cluster


def test_disks_are_in_one_cluster_if_no_other_one_fits_between_them():
    assert largest_cluster([[0.0, 0.0], [13.9, 0.0]], radius_cm=3.5) == 2
    assert largest_cluster([[0.0, 0.0], [14.1, 0.0]], radius_cm=3.5) == 1


def test_a_chain_is_one_cluster():
    chain = [[12.0 * k, 0.0] for k in range(5)]
    assert largest_cluster(chain, radius_cm=3.5) == 5


def test_the_larger_of_two_clusters_counts():
    positions = [[0, 0], [5, 0], [100, 0], [105, 0], [110, 0], [500, 0]]
    assert largest_cluster(positions, radius_cm=3.5) == 3


def test_every_moment_of_every_trial_has_a_largest_cluster():
    positions = np.zeros((2, 3, 4, 2))
    positions[1, 2, :, 0] = [0, 50, 100, 150]
    np.testing.assert_array_equal(largest_cluster(positions, 3.5), [[4, 4, 4], [4, 4, 1]])
