"""The genes in the messages of a mating."""

import math

import numpy as np
import pytest

from crcolony.evolution.genotype import Gene, Schema
from crcolony.protocol.codec import WireError
from crcolony.protocol.mating_messages import pack_genes, unpack_genes


class TestGenes:
    """Genes are finite numbers of the species' schema, each in its range."""

    SCHEMA = Schema((Gene("weight"), Gene("rate", 0.0, 1.0)))

    def test_they_are_received_as_they_were_sent(self) -> None:
        """Every bit is kept, also the sign of zero and the smallest number."""
        genes = np.array([-0.0, 5e-324])
        assert unpack_genes(pack_genes(genes), self.SCHEMA).tobytes() == (genes.tobytes())

    @pytest.mark.parametrize(
        "genes",
        [
            [math.nan, 0.5],
            [math.inf, 0.5],
            [-math.inf, 0.5],
            [0.0, 1.0 + 1e-15],
            [0.0, -5e-324],
            [0.0, math.nan],
            [0.0],
            [0.0, 0.5, 0.5],
        ],
        ids=str,
    )
    def test_other_numbers_are_refused(self, genes: list[float]) -> None:
        """Numbers that are not finite or out of range, too few, and too many."""
        with pytest.raises(WireError):
            unpack_genes(pack_genes(np.array(genes)), self.SCHEMA)

    @pytest.mark.parametrize("length", [0, 1, 8, 15, 17, 24])
    def test_other_lengths_are_refused(self, length: int) -> None:
        """Also lengths that are not a whole number of genes."""
        with pytest.raises(WireError, match="are not 2 genes"):
            unpack_genes(bytes(length), self.SCHEMA)

    def test_a_signalling_nan_is_refused(self) -> None:
        """A NaN is refused whatever its payload."""
        for bits in (0x7FF0_0000_0000_0001, 0xFFF8_0000_0000_0000, 0x7FFF_FFFF_FFFF_FFFF):
            with pytest.raises(WireError):
                unpack_genes(bits.to_bytes(8, "little") + bytes(8), self.SCHEMA)
