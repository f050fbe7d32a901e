"""Accuracy at shaft speeds that a diagnoser was not fitted at, next to its peers."""
