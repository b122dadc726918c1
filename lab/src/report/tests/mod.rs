mod browser;
mod example;
mod files;
