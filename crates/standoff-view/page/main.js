// Which page this is: a report with its data inside, or one that a server feeds.

if (document.querySelector('script[data-part="head"]')) showReplay(new FileSource());
else showReplay(new ServedSource(document.body.dataset.base));
