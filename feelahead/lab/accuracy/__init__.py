"""Parts of `feelahead bench accuracy`: knobs that trade run time against error, and peers on the same inputs."""
