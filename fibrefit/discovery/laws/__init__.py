"""Laws for what has no name: a form for a free curve, written as an effect of one's own."""
