"""What a measured record shows by itself: its rests, rates and periods."""
