"""Exact algebra: values of a tape as polynomials in symbols, sines and cosines; the shortest way to write them; proofs."""
