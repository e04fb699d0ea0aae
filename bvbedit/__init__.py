"""A CAGD toolkit for editing measured BRDFs as B-spline volumes."""
