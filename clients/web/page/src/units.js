// SPDX-License-Identifier: MIT
// Formats figures with their units.

export const figure = (x, digits = 2) => Number.isFinite(x) ? x.toFixed(digits) : '–';

/** A length given in metres. */
export function lengthText(x) {
    const size = Math.abs(x);
    if (size >= 1000) return `${figure(x / 1000, 1)} km`;
    if (size >= 1) return `${figure(x, size < 10 ? 2 : 1)} m`;
    return `${figure(1000 * x, size < 0.01 ? 2 : 1)} mm`;
}

/** Times given in microseconds, all in the unit that suits `measure`: "1.10 / 1.40 ms". */
export function timesText(times, measure) {
    const [unit, by, digits] = measure >= 1e6 ? ['s', 1e6, 2] : measure >= 1000 ? ['ms', 1000, 2] : ['µs', 1, 0];
    return `${times.map((x) => figure(x / by, digits)).join(' / ')} ${unit}`;
}
