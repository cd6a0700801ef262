"""Which effects records can tell apart, and the record that would."""
