"""One page over all designs of a space: filter, search, sort, and look at each."""
