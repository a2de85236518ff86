// node report.mjs FILE: an HTML report opens from disk, offline, and is whole.
import { check, finish, launch, looks, open } from './browser.mjs';

const file = `file://${process.argv[2]}`;
const browser = await launch();
const { context, page } = await open(browser, file);
await context.setOffline(true);
await page.goto(file);
await page.waitForSelector('.chart canvas');

const charts = await page.locator('.chart canvas').count();
check(charts >= 6, `${charts} charts: overlay, residual, error curve, regimes, spectrum, whiteness are wanted`);
check(await page.locator('.verdict h2').first().innerText() !== '', 'the verdict has no words');
check(/truerate \w+/.test(await page.locator('.command code').last().innerText()), 'no command to run next');
check(await page.locator('.suspect, .steps .fall i').count() > 0, 'neither a suspect nor a step');
check(await page.locator('details dl').first().evaluate(d => d.children.length > 6), 'the card of an effect is empty');

// Hovering says the value with its unit, on every chart in view; dragging zooms; the keyboard too, and back.
const hover = async chart => {
  await chart.scrollIntoViewIfNeeded();
  const over = await chart.locator('.u-over').boundingBox();
  await page.mouse.move(over.x + over.width / 2, over.y + over.height / 2);
  return { over, legend: await chart.locator('.u-legend').innerText() };
};
const visible = await page.locator('.chart:visible').all();
const legends = [];
for (const chart of visible) legends.push((await hover(chart)).legend);
check(legends.every(legend => /\d/.test(legend)), `hovering says nothing: ${JSON.stringify(legends)}`);
check(legends.some(legend => legend.includes('°/s') && /τ:?\s*[\d.]/.test(legend)), `no error curve among ${JSON.stringify(legends)}`);
check(legends.some(legend => legend.includes('%') && /τ:?\s*[\d.]/.test(legend)), `no budget among ${JSON.stringify(legends)}`);
const chart = visible[0];
const { over } = await hover(chart);
await page.mouse.down();
await page.mouse.move(over.x + over.width * 0.7, over.y + over.height * 0.7, { steps: 4 });
await page.mouse.up();
check(await chart.evaluate(c => c.classList.contains('zoomed')), 'dragging does not zoom');
await chart.focus();
await page.keyboard.press('0');
check(!await chart.evaluate(c => c.classList.contains('zoomed')), 'the key 0 does not show the whole again');
await page.keyboard.press('+');
check(await chart.evaluate(c => c.classList.contains('zoomed')), 'the key + does not zoom');
await page.keyboard.press('0');

await looks(page, 'report');
await browser.close();
finish();
