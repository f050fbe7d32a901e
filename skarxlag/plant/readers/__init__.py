"""Recordings: from files and tables of files to windows."""
