"""Several sessions together: what they share, whether they agree, and the one body that they tell of."""
