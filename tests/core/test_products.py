"""Products in blocks: what they are, and that no number of threads changes a bit of them."""

from __future__ import annotations

import os
import subprocess
import sys

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.programs import column_products

SHAPES = (6, 8192), (33, 8192), (65, 5000), (256, 1000)
SCRIPT = """
import hashlib, sys
from fibrefit.core.environment import configure_jax
configure_jax()
import jax, jax.numpy as jnp, numpy as np
from fibrefit.core.programs import column_products
found = hashlib.sha256()
for k, n in {shapes}:
    rows = np.random.default_rng(k).normal(size=(2, k, n))
    for made in (column_products(rows.swapaxes(1, 2), rows.swapaxes(1, 2)), jnp.sum(rows)):
        found.update(np.asarray(made).tobytes())
    found.update(np.asarray(jax.jit({plain})(rows)).tobytes())
print(found.hexdigest())
"""


def digest(threads: int, plain: str) -> str:
    """Of products in blocks, of a sum, and of another product, by so many threads of the compiler."""
    script = SCRIPT.format(shapes=SHAPES, plain=plain)
    return subprocess.run(
        [sys.executable, "-c", script], env=os.environ | {"NPROC": str(threads)}, capture_output=True, text=True,
        check=True,
    ).stdout  # fmt: skip


@pytest.mark.parametrize("n", [1, 255, 256, 1000])
def test_they_are_the_products(n: int) -> None:
    one, other = (np.random.default_rng(i).normal(size=(2, k, n)) for i, k in enumerate((3, 5)))
    expected = one @ other.swapaxes(1, 2)
    columns = (jnp.asarray(array.swapaxes(1, 2)) for array in (one, other))
    np.testing.assert_allclose(column_products(*columns), expected, rtol=1e-12, atol=1e-12)


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere another library multiplies")
def test_threads_change_no_bit() -> None:
    assert digest(1, "lambda rows: rows") == digest(8, "lambda rows: rows")


@pytest.mark.skipif(sys.platform != "linux", reason="elsewhere another library multiplies")
def test_threads_do_change_the_bits_of_a_product_in_one_go() -> None:
    """Were it not so, the blocks would be of no use."""
    plain = "lambda rows: rows @ rows.swapaxes(1, 2)"
    assert digest(1, plain) != digest(8, plain)
