"""Parts that rigs are built of: fibre, guide, pulley, mount."""
