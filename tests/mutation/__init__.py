"""Mutation tests: the share of small errors in modules that the tests detect."""
