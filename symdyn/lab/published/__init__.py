"""Published mechanisms within their bounds: `symdyn bench published`."""
