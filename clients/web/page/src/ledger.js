// SPDX-License-Identifier: MIT
// The ledger: what became of each tissue, and how near a cut came to the regions of the scene.

import { figure, lengthText } from './units.js';

const element = (id) => document.getElementById(id);

const unitOf = (solid) => (solid ? 'cm³' : 'cm²');
/** An amount at rest, in that unit. */
const amountText = (amount, solid) => {
    const shown = amount * (solid ? 1e6 : 1e4);
    return shown === 0 ? '0' : figure(shown, shown < 1 ? 3 : 2);
};

function row(cells, title, className = '') {
    const line = document.createElement('tr');
    for (const text of cells) {
        const cell = document.createElement('td');
        cell.textContent = text;
        line.append(cell);
    }
    line.title = title;
    line.className = className;
    return line;
}

/** A region's line: [name, distance and by what, what was asked for], and whether it was kept. */
export function regionTexts({ name, keep, touched, margin, distance, by }) {
    const cut = distance >= 0;
    const kept = !(cut && distance < margin) && !(keep && touched);
    const asked = [margin > 0 ? `≥ ${lengthText(margin)}` : '', keep ? 'keep' : ''].filter(Boolean).join(', ');
    const near = !cut ? 'nothing cut' : touched ? `${by} inside` : `${lengthText(distance)}, ${by}`;
    return { cells: [name, near, asked], kept };
}

export class Ledger {
    constructor() { this.box = element('ledger'); }

    clear() { this.box.hidden = true; }

    take({ body, tissue, region }) {
        const solid = new Map(body.map(({ name, solid }) => [name, solid]));
        const several = body.length > 1;
        const unit = new Set(solid.values()).size === 1 ? unitOf(body[0].solid) : ''; // for all
        element('ledger-unit').textContent = unit ? `tissue, ${unit}` : 'tissue';
        element('ledger-tissues').replaceChildren(...tissue.map((of) => {
            const isSolid = solid.get(of.body);
            const amount = (value) => amountText(value, isSolid);
            const grams = (value) => `${figure(1000 * value * of.density, 2)} g`;
            const name = several && of.name !== of.body ? `${of.body}: ${of.name}` : of.name;
            const coagulated = of.coagulated > 0 ? `, ${amount(of.coagulated)} coagulated` : '';
            return row([unit ? name : `${name}, ${unitOf(isSolid)}`, amount(of.attached), amount(of.cut_off), amount(of.removed)],
                `of ${amount(of.at_load)} ${unitOf(isSolid)} (${grams(of.at_load)}) ${grams(of.cut_off)} cut off, ` +
                `${grams(of.removed)} removed${coagulated}`);
        }));
        element('ledger-regions').replaceChildren(...region.map((of) => {
            const { cells, kept } = regionTexts(of);
            const inside = of.time > 0 ? `, tools were inside for ${figure(of.time, 1)} s` : '';
            return row(cells, `${kept ? 'kept' : 'not kept'}${inside}`, kept ? '' : 'bad');
        }));
        element('ledger-regions').parentElement.hidden = region.length === 0;
        element('ledger-sections').textContent = body.filter(({ cut, torn }) => cut + torn > 0)
            .map(({ name, cut, torn }) => `${several ? `${name}: ` : ''}${figure(1e4 * cut, 2)} cm² cut` +
                (torn > 0 ? `, ${figure(1e4 * torn, 2)} cm² torn` : '')).join('; ');
        this.box.hidden = false;
    }
}
