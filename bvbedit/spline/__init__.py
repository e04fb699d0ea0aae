"""B-splines of any dimension: knots, basis, tensor-product splines, fitting and operations. Knows nothing of light."""
