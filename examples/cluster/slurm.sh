#!/bin/sh
# sbatch --array=0-15 slurm.sh drives.txt results
#SBATCH --job-name=raywake
#SBATCH --cpus-per-task=2
#SBATCH --mem=1G
#SBATCH --requeue
exec raywake run --list "$1" --out "$2" --parquet --backend scalar --quiet
