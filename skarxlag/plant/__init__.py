"""Reading of recordings, and the commands of the shell: the first user of the library."""
