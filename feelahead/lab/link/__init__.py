"""Parts of `bench link`: samples of delays, sockets and ends of real processes, traffic between two clocks."""
