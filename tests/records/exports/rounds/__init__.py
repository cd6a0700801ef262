"""Sets of layouts that were each written whole, with their truth, before the reader saw any of them."""
