#!/usr/bin/env python3
"""Seconds per epoch of the paper's network and recipe in PyTorch, beside `ravenpose train --preset paper` (docs/training.md).

Needs PyTorch (Debian: apt-get install python3-torch). Rows are random numbers: the work is the same.
"""
import argparse
import time

import torch


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", type=int, default=198000, help="rows of training")
    parser.add_argument("--epochs", type=int, default=3)
    parser.add_argument("--threads", type=int, default=2)
    options = parser.parse_args()
    torch.manual_seed(1)
    torch.set_num_threads(options.threads)
    widths = [118, 600, 500, 400]
    layers = []
    for inputs, outputs in zip(widths, widths[1:]):
        layers += [torch.nn.Linear(inputs, outputs), torch.nn.BatchNorm1d(outputs), torch.nn.Sigmoid()]
    network = torch.nn.Sequential(*layers, torch.nn.Linear(widths[-1], 3))
    optimiser = torch.optim.Adam(network.parameters(), lr=1e-3, betas=(0.9, 0.999), eps=1e-8)
    x, y = torch.randn(options.rows, widths[0]), torch.randn(options.rows, 3)
    weights = [layer.weight for layer in network if isinstance(layer, torch.nn.Linear)]
    for epoch in range(options.epochs):
        begun = time.perf_counter()
        for batch in torch.randperm(options.rows).split(1024):
            optimiser.zero_grad()
            loss = torch.nn.functional.mse_loss(network(x[batch]), y[batch])
            loss = loss + 5e-6 * sum(weight.abs().sum() for weight in weights)
            loss.backward()
            optimiser.step()
        print(f"PyTorch {torch.__version__}, {options.threads} threads, epoch {epoch + 1}: {time.perf_counter() - begun:.1f} s", flush=True)


if __name__ == "__main__":
    main()
