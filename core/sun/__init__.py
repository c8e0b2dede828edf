"""Where the sun stands, and which of its positions are traced."""
