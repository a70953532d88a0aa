"""From domain and problem to STRIPS: variables bound, and all that simple planners lack compiled away."""
