"""Pages about one mechanism as a whole: its equations, its condition, its motion, what it costs."""
