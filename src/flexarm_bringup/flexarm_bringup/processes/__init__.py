"""The graph of processes: started, supervised, commanded and listened to."""
