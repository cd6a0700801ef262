"""Laws of the rig's geometry."""
