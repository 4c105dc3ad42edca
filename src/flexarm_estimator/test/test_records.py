"""Records of a block: where they say they are, apart from each other, new every time."""

import ctypes

import numpy as np

from flexarm_estimator.steps.records import RecordPool, Records

SHAPES = (2,), (3, 3), (0,), (4,)


def test_records_are_apart_and_lie_one_array_behind_the_other_where_they_say():
    """Over several blocks; machine code reads what NumPy has written."""
    records, taken = Records(*SHAPES), []
    for k in range(50):
        address, *arrays = records.take()
        assert [array.shape for array in arrays] == list(SHAPES)
        assert not any(array.any() for array in arrays)
        for i, array in enumerate(arrays):
            array[...] = 10.0 * k + i
        taken.append((address, arrays))
    for k, (address, arrays) in enumerate(taken):
        read = np.ctypeslib.as_array((ctypes.c_double * 15).from_address(address))
        np.testing.assert_array_equal(read, np.concatenate([array.ravel() for array in arrays]))
        np.testing.assert_array_equal(read, 10.0 * k + np.repeat([0.0, 1.0, 3.0], [2, 9, 4]))


def test_what_is_read_only_is_written_by_machine_code_alone():
    address, first, _ = Records((1,), (2, 2), is_read_only=True).take()
    assert not first.flags.writeable
    ctypes.c_double.from_address(address).value = 3.0
    assert first[0] == 3.0


def test_a_pool_has_one_make_of_every_shape():
    pool = RecordPool()
    assert pool.records((2,), (3,)) is pool.records((2,), (3,))
    assert pool.records((2,), (3,)) is not pool.records((2, 3))
