"""The measuring instrument: what the service costs beside a naive one and beside a floor in C.

Rules. Contestants run as processes of their own on one processor, the load generator on another; they are judged by
what they answer (`check`) before they are measured. Ratios taken in one run are what counts. Linux alone: it pins
processes and reads /proc.
"""
