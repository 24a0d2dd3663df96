"""A recording under way: what contradicts the model so far, and how well the body will be known."""
